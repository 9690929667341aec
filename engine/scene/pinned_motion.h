#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "engine/bodies/tet_mesh.h"
#include "engine/scene/scene.h"

namespace limber::scene {

/// A motion of a body whose pins follow given paths. It is a rigid motion, by least squares of the
/// pins, and the rest of their displacements, which spreads harmonically between them. Pins on a
/// line, or fewer than three, give no rotation: the rigid part is their mean displacement.
/// @param pins  node ids of the mesh, each once
/// @param positions  of these nodes in their order, 3 pins x frames [scene unit]
/// @returns displacements from rest, 3n x frames [scene unit]
/// @throws Error{kNumerical} where the mesh has edges that are not finite
[[nodiscard]] Eigen::MatrixXd motion_of_pins(const bodies::TetMesh& mesh,
                                             const std::vector<int>& pins,
                                             const Eigen::Ref<const Eigen::MatrixXd>& positions);

/// Fault in the paths of a scene's fixed nodes: sizes, numbers, or a motion of more than 2.5e8
/// numbers. Without a fault motion_of_pins() accepts them, if the mesh is valid.
/// @param positions  3 fixed nodes x frames [scene unit]
/// @returns an issue without a field
[[nodiscard]] std::optional<Issue> pins_fault(const Scene& scene,
                                              const Eigen::Ref<const Eigen::MatrixXd>& positions);

/// The scene with the base motion of these paths; null: unchanged.
[[nodiscard]] Scene with_pins(Scene scene, const std::shared_ptr<const Eigen::MatrixXd>& positions);

}  // namespace limber::scene
