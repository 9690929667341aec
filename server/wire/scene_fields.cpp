#include "server/wire/scene_fields.h"

#include <algorithm>
#include <vector>

namespace limber::server {

const google::protobuf::FieldDescriptor* field_beside(
    const limber::v1::Scene& scene, std::initializer_list<std::string_view> names) {
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  scene.GetReflection()->ListFields(scene, &fields);
  const auto found = std::find_if(fields.begin(), fields.end(), [&](const auto* field) {
    return std::find(names.begin(), names.end(), field->name()) == names.end();
  });
  return found == fields.end() ? nullptr : *found;
}

}  // namespace limber::server
