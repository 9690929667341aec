#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// About so large is a part of an export.
inline constexpr std::uint64_t kPartBytes = std::uint64_t{16} << 20;

/// @param append  to what an earlier part has of the file
void add_file(proto::ExportResponse& response, std::string name, std::string content,
              bool append = false);

/// A file that an export makes.
struct TextFile {
  std::string name, content;
};

/// @throws Refusal OUT_OF_RANGE naming `part`
[[noreturn]] void refuse_part(std::uint32_t part, std::uint32_t parts);

/// Files one after another, cut where a part of about 16 MB is full.
/// @throws Refusal as refuse_part, where there are not so many
[[nodiscard]] proto::ExportResponse cut_into_parts(const std::vector<TextFile>& files,
                                                   std::uint32_t part);

}  // namespace limber::server
