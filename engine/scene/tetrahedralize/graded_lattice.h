#pragma once

#include <unordered_map>

#include "engine/scene/tetrahedralize/lattice.h"
#include "engine/scene/tetrahedralize/octree.h"
#include "engine/scene/tetrahedralize/stencils.h"

namespace limber::scene::lattice {

/// Isosurface stuffing over the leaves of an octree: the same points, cuts and stencils as with one
/// cell size, smaller where the tree is split. Values of the solid are kept between calls.
class GradedLattice {
 public:
  /// @param solid  must outlive the lattice
  GradedLattice(const ImplicitSolid& solid, double root_cell);

  [[nodiscard]] Octree& octree() { return octree_; }
  /// @throws Error{kLimitExceeded} if the tree has more leaves than `max_leaves`
  [[nodiscard]] Stuffing stuff(std::size_t max_leaves, const JobContext& job);

 private:
  double value(std::uint64_t point);
  void snap(const std::vector<BackgroundTet>& tets, const Octree::Points& points,
            std::vector<double>& values, std::vector<Eigen::Vector3d>& positions) const;

  const ImplicitSolid& solid_;
  double root_cell_;
  Octree octree_;
  SurfaceCutter cutter_;
  std::unordered_map<std::uint64_t, double> values_;
};

}  // namespace limber::scene::lattice
