#include "server/kinds/bodies/stiffness.h"

#include <fmt/format.h>

#include <filesystem>
#include <vector>

#include "engine/scene/formats/stiffness_files.h"
#include "engine/scene/painted_stiffness.h"
#include "server/wire/enum_table.h"
#include "server/wire/fields.h"

namespace limber::server {
namespace {

constexpr EnumTable<scene::StiffnessQuantity, proto::PaintedQuantity, proto::PaintedQuantity_MAX>
    kQuantities{{scene::StiffnessQuantity::kFactor, proto::PAINTED_QUANTITY_FACTOR},
                {scene::StiffnessQuantity::kYoungsModulus, proto::PAINTED_QUANTITY_YOUNGS_MODULUS}};

/// @param count  of the points
std::vector<scene::PaintedStiffness> read_values(const proto::PaintedStiffness& message,
                                                 const std::string& field, const FileReader& read,
                                                 int count) {
  const auto quantity = kQuantities.decode(message.quantity());
  if (message.source_case() != proto::PaintedStiffness::SOURCE_NOT_SET && message.values_size() > 0)
    throw invalid(field + ".values", "are given in place of a file, not with one");
  const auto read_file = [&](const std::string& at, const std::string& name,
                             const std::string& content) {
    return read_at(at, [&] { return scene::read_stiffness(name, content, quantity, count); });
  };
  switch (message.source_case()) {
    case proto::PaintedStiffness::kFile:
      return read_file(field + ".file", message.file().name(), message.file().content());
    case proto::PaintedStiffness::kPath:
      return read_file(field + ".path", std::filesystem::path(message.path()).filename().string(),
                       read(message.path(), field + ".path"));
    case proto::PaintedStiffness::SOURCE_NOT_SET:
      break;
  }
  std::vector<scene::PaintedStiffness> values;
  for (const double value : message.values()) values.push_back({value, quantity});
  return values;
}

}  // namespace

void paint_stiffness(const proto::PaintedStiffness& message, const std::string& field,
                     const FileReader& read, scene::Scene& scene) {
  const bool is_surface = message.points() == proto::PAINTED_POINTS_SURFACE ||
                          (message.points() != proto::PAINTED_POINTS_NODES && scene.surface);
  if (is_surface && !scene.surface)
    throw invalid(field + ".points", "the scene names no surface that could be painted");
  if (scene.mesh.node_count() == 0) return;  // it could not be read, which is reported
  const int count = is_surface ? scene.surface->surface.vertex_count() : scene.mesh.node_count();
  const auto values = read_values(message, field, read, count);
  with_fields(
      [&](const std::string& name) {
        return message.values_size() > 0 ? field + "." + name : field;
      },
      [&] {
        if (is_surface) {
          scene::paint_surface(scene.surface->surface.vertices, values, scene.material, scene.mesh);
        } else {
          scene::paint_nodes(values, scene.material, scene.mesh);
        }
      });
}

}  // namespace limber::server
