#pragma once

#include <Eigen/Core>
#include <memory>

#include "engine/rods/design/surface_mesh.h"

namespace limber::rods {

/// From the unit square back to the patch that map_patch_to_square spread over it.
class PatchLift {
 public:
  /// @param surface  must outlive this
  /// @throws Error as map_patch_to_square
  explicit PatchLift(const SurfaceMesh& surface);
  ~PatchLift();

  /// A hierarchy of boxes finds the triangle in about log t steps.
  /// @param at  in [0, 1]^2, up to rounding
  /// @returns the point of the surface that the map puts there
  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector2d& at) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace limber::rods
