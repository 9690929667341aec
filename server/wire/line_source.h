#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "limber/v1/scene.pb.h"
#include "server/wire/fields.h"
#include "server/wire/paths.h"

namespace limber::server {
namespace proto = limber::v1;

/// Lines from a file here or in the message, by its reader; nothing where the source is another.
/// @param of_file     a path's mesh
/// @param of_content  the mesh of a file's name and content
template <class OfFile, class OfContent>
auto read_lines(const proto::LineSource& source, const std::string& field,
                const PathResolver& resolve, const OfFile& of_file, const OfContent& of_content)
    -> std::optional<decltype(of_file(std::filesystem::path()))> {
  if (source.has_path()) {
    const std::filesystem::path file = resolve(source.path(), field + ".path");
    return read_at(field + ".path", [&] { return of_file(file); });
  }
  if (source.has_file()) {
    return read_at(field + ".file",
                   [&] { return of_content(source.file().name(), source.file().content()); });
  }
  return std::nullopt;
}

}  // namespace limber::server
