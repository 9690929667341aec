#pragma once

#include <cstddef>
#include <vector>

#include "engine/scene/formats/mesh_formats.h"

namespace limber::scene::formats {

/// Which tet is of which material, while a file is read: tets may still have none.
class MaterialTable {
 public:
  explicit MaterialTable(std::size_t tet_count) : tet_material_(tet_count, -1) {}

  int add_material(const bodies::Material& material);
  [[nodiscard]] bool assigned(int tet) const {
    return tet_material_[static_cast<std::size_t>(tet)] >= 0;
  }
  void assign(int tet, int material) { tet_material_[static_cast<std::size_t>(tet)] = material; }
  void assign_unassigned(int material);

  /// Gives the mesh its materials. Tets without one get Material{}, with a warning. If no tet has
  /// one, the mesh is left without materials (the scene's own applies), with a warning if the file
  /// has any materials.
  void store(MeshReading& reading) const;

 private:
  std::vector<bodies::Material> materials_;
  std::vector<int> tet_material_;
};

}  // namespace limber::scene::formats
