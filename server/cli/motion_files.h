#pragma once

#include <filesystem>
#include <memory>

#include "limber/v1/service.pb.h"
#include "server/kinds/bodies/export.h"

namespace limber::server {

/// The format for the ending of a file name: .pc2 (with an .obj), .pvd or .vtu (both: a series).
/// @throws Refusal naming "output"
[[nodiscard]] proto::ExportFormat motion_format(const std::filesystem::path& output);

/// Before minutes are spent on what could not be written.
/// @throws Error{kIo} naming the option
void demand_folder(const std::filesystem::path& file, const char* field);

/// Writes the files of a motion into one folder. @throws Error{kIo} naming the path
void write_motion(const std::shared_ptr<const ComputedMotion>& motion, proto::ExportFormat format,
                  const std::filesystem::path& output);

}  // namespace limber::server
