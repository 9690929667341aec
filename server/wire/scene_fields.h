#pragma once

#include <initializer_list>
#include <string_view>

#include "limber/v1/scene.pb.h"

namespace limber::server {

/// The first field of the scene besides these; null where there is none.
[[nodiscard]] const google::protobuf::FieldDescriptor* field_beside(
    const limber::v1::Scene& scene, std::initializer_list<std::string_view> names);

}  // namespace limber::server
