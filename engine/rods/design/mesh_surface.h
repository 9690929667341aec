#pragma once

#include <memory>

#include "engine/rods/design/surface_mesh.h"
#include "engine/rods/design/target_surface.h"

namespace limber::rods {

/// Triangles as a target. Closest points lie in a triangle, on an edge or at a vertex, and are
/// those of the nearest triangle in double precision. A hierarchy of boxes finds them in about log
/// t steps.
///
/// Rims, holes, several pieces, edges of three triangles and triangles turned against each other
/// are all right here: distances do not see them. Triangles without area are passed over.
class MeshSurface final : public TargetSurface {
 public:
  /// @throws Error as check_surface_mesh
  explicit MeshSurface(SurfaceMesh mesh);
  ~MeshSurface() override;

  /// Among equally near triangles, the choice depends on the mesh alone.
  /// @pre the point is finite
  [[nodiscard]] ClosestPoint closest(const Eigen::Vector3d& point) const override;
  [[nodiscard]] double area() const override { return area_; }
  [[nodiscard]] const SurfaceMesh& mesh() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  double area_;
};

}  // namespace limber::rods
