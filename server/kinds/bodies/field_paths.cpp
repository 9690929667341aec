#include "server/kinds/bodies/field_paths.h"

#include <fmt/format.h>

#include "engine/base/checked_number.h"
#include "server/wire/fields.h"

namespace limber::server {
namespace {

constexpr std::string_view kMaterials = "mesh.materials[";

}  // namespace

std::string body_field_in(const proto::Scene& message, const scene::Scene& scene,
                          const std::string& field) {
  if (field.starts_with("constraints[") || field.starts_with("keyframes["))
    return field_in(message, field);
  const std::size_t close = field.find(']');
  if (!field.starts_with(kMaterials) || close == std::string::npos) return field;
  if (message.has_painted_stiffness()) return "painted_stiffness";  // they are made of it
  const auto index = parse_number<int>(
      std::string_view(field).substr(kMaterials.size(), close - kMaterials.size()));
  if (!index) return field;
  const std::string rest = field.substr(close + 1);
  const int groups = message.material_groups_size();
  const int group = *index - (static_cast<int>(scene.mesh.materials.size()) - groups);
  if (group >= 0 && group < groups)
    return fmt::format("material_groups[{}].material{}", group, rest);
  if (groups > 0) return "material" + rest;  // of the tets that are in no group
  return field;
}

}  // namespace limber::server
