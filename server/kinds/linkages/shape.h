#pragma once

#include <string>

#include "engine/rods/linkage/state_numbers.h"
#include "limber/v1/scene.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

[[nodiscard]] proto::LinkageShape encode_linkage_shape(const rods::StateNumbers& shape);

/// Arrays are checked in themselves; whether they are a shape of the linkage, the engine says.
/// @param field  path of the message, for errors
/// @throws Refusal naming the array
[[nodiscard]] rods::StateNumbers decode_linkage_shape(const proto::LinkageShape& message,
                                                      const std::string& field);

}  // namespace limber::server
