#pragma once

#include <string>

#include "engine/scene/scene.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// A field of the engine's scene as one of the message. The last of a mesh's materials are those of
/// `material_groups`; the places of constraints and keyframes are found by field_in().
/// @param scene  as decoded from `message`
[[nodiscard]] std::string body_field_in(const proto::Scene& message, const scene::Scene& scene,
                                        const std::string& field);

}  // namespace limber::server
