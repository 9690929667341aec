#pragma once

#include <Eigen/Core>
#include <optional>

#include "engine/scene/scene.h"

namespace limber::scene {

inline constexpr double kFarthestNode = 1e6;  // from rest [body lengths]

/// The farthest that a node of a scene's poses may be from its rest position, along any axis [scene
/// length unit]; no bound if the mesh has no extent (a reported fault of the mesh).
[[nodiscard]] double reach_of_poses(const Scene& scene);

/// Fault in a pose that would make every computation with it impossible.
/// @param displacements  3 nodes [scene length unit]
/// @returns an issue without a field
[[nodiscard]] std::optional<Issue> pose_fault(
    const Eigen::Ref<const Eigen::VectorXd>& displacements, double reach);

}  // namespace limber::scene
