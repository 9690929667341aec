#pragma once

#include <filesystem>
#include <string>

#include "server/wire/paths.h"

namespace limber::server {

/// For a scene file: paths are relative to it, and the user may name any file of theirs.
[[nodiscard]] PathResolver paths_beside(const std::filesystem::path& scene_file);

enum class WriteMode { kReplace, kAppend };
/// @throws Error{kIo} naming the path
void write_file(const std::filesystem::path& path, const std::string& content,
                WriteMode mode = WriteMode::kReplace);

}  // namespace limber::server
