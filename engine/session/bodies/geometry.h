#pragma once

#include <Eigen/Core>

#include "engine/reduced/reduced_model.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/session/bodies/session.h"

namespace limber::session {

/// The mesh as the client sent it, with the surface of the prepared one and without a basis.
[[nodiscard]] Geometry rest_geometry(const scene::Scene& scene, const MappedBody& mapped);

/// The view of a model on the mesh as the client sent it. Unused nodes stay at rest (zero rows of
/// the basis), merged duplicates move together (equal rows).
/// The same mesh with another basis. @param basis  B, 3n x h, compact nodes [m]
[[nodiscard]] Geometry with_basis(Geometry geometry, const scene::Scene& scene,
                                  const std::vector<int>& compact_of_source,
                                  const Eigen::MatrixXd& basis);

[[nodiscard]] Geometry make_geometry(const scene::Scene& scene, const MappedBody& mapped,
                                     const reduced::ReducedModel& model);

/// Positions [scene units], 3 source nodes x columns of q: rest + basis q, computed in double.
[[nodiscard]] Eigen::MatrixXd positions_of(const Geometry& geometry, const LengthUnit& unit,
                                           const std::vector<int>& compact_of_source,
                                           const Eigen::MatrixXd& basis,
                                           const Eigen::Ref<const Eigen::MatrixXf>& coordinates);

/// Displacements of compact nodes (3n x k [m]) as those of the nodes that the client sent [scene
/// units], 3 source nodes x k; 0 of nodes of no tet.
[[nodiscard]] Eigen::MatrixXd source_displacements(
    const scene::Scene& scene, const std::vector<int>& compact_of_source,
    const Eigen::Ref<const Eigen::MatrixXd>& displacements);

/// Positions [scene units] of displacements (3n x frames [m] of compact nodes), 3 source nodes x
/// frames. Nodes of no tet stay where they are.
[[nodiscard]] Eigen::MatrixXd source_positions(
    const scene::Scene& scene, const MappedBody& mapped,
    const Eigen::Ref<const Eigen::MatrixXd>& displacements);

/// The scene with a motion (3 source nodes x frames [scene units]) as its base motion; it has the
/// motion's frames, and neither constraints nor keyframes in others.
[[nodiscard]] scene::Scene with_base_motion(scene::Scene scene, const Eigen::MatrixXd& positions);

}  // namespace limber::session
