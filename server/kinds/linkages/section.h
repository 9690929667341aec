#pragma once

#include <string>

#include "engine/scene/linkage.h"
#include "limber/v1/scene.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// @throws Refusal where it is missing, or where an array is none; dimensions are the engine's to
/// refuse
[[nodiscard]] rods::Section decode_section(const proto::RodSection& message,
                                           const std::string& field);
[[nodiscard]] proto::RodSection encode_section(const rods::Section& section);

}  // namespace limber::server
