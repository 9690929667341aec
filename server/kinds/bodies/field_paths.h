#pragma once

#include <string>

#include "engine/scene/scene.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// A field of the engine's scene as one of the message: the last of a mesh's materials are those of
/// `material_groups`, and what constraints and keyframes are given by is found by field_in().
/// @param scene  as decoded from `message`
[[nodiscard]] std::string body_field_in(const proto::Scene& message, const scene::Scene& scene,
                                        const std::string& field);

}  // namespace limber::server
