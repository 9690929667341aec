#pragma once

#include <filesystem>
#include <string>

#include "limber/v1/scene.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

/// The text of a scene file; paths stay as they are. @param path  of the file, for messages
/// @throws ClientError INVALID_ARGUMENT naming the field below `scene`
[[nodiscard]] v1::Scene parse_scene(const std::string& text, const std::filesystem::path& path);

}  // namespace limber::client
