#include "engine/scene/formats/material_table.h"

#include <algorithm>

namespace limber::scene::formats {

int MaterialTable::add_material(const bodies::Material& material) {
  materials_.push_back(material);
  return static_cast<int>(materials_.size()) - 1;
}

void MaterialTable::assign_unassigned(int material) {
  for (int& entry : tet_material_) {
    if (entry < 0) entry = material;
  }
}

void MaterialTable::store(MeshReading& reading) const {
  if (materials_.empty()) return;
  const auto missing = std::count(tet_material_.begin(), tet_material_.end(), -1);
  if (missing == static_cast<std::ptrdiff_t>(tet_material_.size())) {
    reading.warnings.push_back("no tetrahedron is known to have one of the file's " +
                               std::to_string(materials_.size()) +
                               " materials; the scene's material applies");
    return;
  }
  reading.mesh.materials = materials_;
  reading.mesh.tet_material = tet_material_;
  if (missing > 0) {
    const int fallback = static_cast<int>(materials_.size());
    reading.mesh.materials.push_back(bodies::Material{});
    std::replace(reading.mesh.tet_material.begin(), reading.mesh.tet_material.end(), -1, fallback);
    reading.warnings.push_back(std::to_string(missing) +
                               " tetrahedra have no material in the file and get the default "
                               "(E 1e6 Pa, nu 0.45, density 1000 kg/m^3)");
  }
}

}  // namespace limber::scene::formats
