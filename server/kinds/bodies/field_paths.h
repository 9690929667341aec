#pragma once

#include <string>

#include "engine/scene/scene.h"
#include "limber/v1/service.pb.h"

namespace limber::server {

namespace proto = limber::v1;

/// The engine names fields of its own values; these are the same places in the message that the
/// client sent and can look up: a constraint's `target` is its `position` or `displacement`, and
/// the last of a mesh's materials are those of `material_groups`. What has no other name stays.
/// @param scene  as decoded from `message`
[[nodiscard]] std::string field_in(const proto::Scene& message, const scene::Scene& scene,
                                   const std::string& field);
[[nodiscard]] std::string field_in(const proto::EditRequest& message, const std::string& field);

}  // namespace limber::server
