#pragma once

#include <string>
#include <string_view>

#include "limber/v1/scene.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

/// A scene file: the JSON form of proto::Scene, field names as in the .proto (lowerCamelCase is
/// read too).
/// @throws Refusal INVALID_ARGUMENT for text that is no JSON, unknown fields, wrong types, NaN
[[nodiscard]] proto::Scene scene_from_json(std::string_view text);
[[nodiscard]] std::string scene_to_json(const proto::Scene& scene);

}  // namespace limber::server
