#pragma once

#include <filesystem>
#include <string>

#include "limber/v1/scene.pb.h"

namespace limber::client {

namespace v1 = limber::v1;

/// A rod linkage of the lines of an .obj. Its rods are laths: a tenth of the median line wide, a
/// twentieth high; material and all else by the server's defaults.
/// @throws ClientError IO, INVALID_ARGUMENT naming `scene` where there is no line of some length
[[nodiscard]] v1::Scene scene_of_lines(const std::filesystem::path& path);

/// Properties of such a scene that its file does not define, in words. @param scene  as the server
/// has it: with its defaults
[[nodiscard]] std::string linkage_assumptions(const v1::Scene& scene);

}  // namespace limber::client
