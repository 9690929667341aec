#pragma once

#include <functional>

#include "engine/scene/scene.h"
#include "engine/scene/tetrahedralize/tetrahedralize.h"

namespace limber::scene::samples {

[[nodiscard]] Scene make_beam();
[[nodiscard]] Scene make_flower();
[[nodiscard]] Scene make_bird();
[[nodiscard]] Scene make_dino();

/// The mesh of a sample's body; no part of it may be lost.
[[nodiscard]] bodies::TetMesh mesh_of(const ImplicitSolid& solid,
                                      const TetrahedralizeOptions& options);
/// Fixes every node at whose rest position `inside` holds. There must be some.
void fix_where(Scene& scene, const std::function<bool(const Eigen::Vector3d&)>& inside);
/// The node nearest to a point; the smaller id if two are equally near.
[[nodiscard]] int node_near(const bodies::TetMesh& mesh, const Eigen::Vector3d& point);
/// Adds a soft constraint on the displacement of one node.
void add_target(Scene& scene, int frame, int node, const Eigen::Vector3d& displacement);

}  // namespace limber::scene::samples
