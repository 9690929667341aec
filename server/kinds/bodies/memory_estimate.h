#pragma once

#include <cstdint>

#include "engine/scene/scene.h"

namespace limber::server {

/// Peak memory of building and keeping a session [bytes], from its sizes alone and rather too high.
/// It covers poses of the training (hundreds of columns of 3n), modes, basis, stiffness and its
/// factor, per-tet operators, base motion, kept results, constraints. The memory for undo is
/// bounded separately (session::SessionOptions).
[[nodiscard]] std::uint64_t estimate_session_bytes(const scene::Scene& scene);
/// The same with another model than the scene asks for.
[[nodiscard]] std::uint64_t estimate_session_bytes(const scene::Scene& scene,
                                                   const scene::ModelRequest& model);

/// The additional memory of a base motion for either, if the scene has none [bytes].
[[nodiscard]] std::uint64_t estimate_base_motion_bytes(const scene::Scene& scene);

/// Memory of a session that is built [bytes]: modes, basis, the factor of the stiffness, per-tet
/// operators, base motion, results, constraints and keyframes.
[[nodiscard]] std::uint64_t estimate_kept_bytes(const scene::Scene& scene);

/// The same for a simulation: the factor of its steps, and the motion as computed and as kept.
[[nodiscard]] std::uint64_t estimate_simulation_bytes(const scene::Scene& scene);

/// The same of a recovery that makes so many frames: modes, the projection and the reconstruction,
/// the steps of the recovery (r^3 numbers a frame), and the motion.
[[nodiscard]] std::uint64_t estimate_recovery_bytes(const scene::Scene& scene, int total_frames);

/// The part of it that so many constraints need [bytes]: the solver keeps their system and the
/// response of every constrained frame to every other, both dense.
/// Constraints of a scene as estimate_constraint_bytes() counts them: velocities twice.
[[nodiscard]] std::size_t constraints_of(const scene::Scene& scene);
[[nodiscard]] std::uint64_t estimate_constraint_bytes(std::size_t constraints, int modes);

/// The additional memory of keyframes [bytes], without their poses: in proportion to their number,
/// except for the part for material optimisation.
/// @param rows_each  one for each modal coordinate
[[nodiscard]] std::uint64_t estimate_keyframe_bytes(std::size_t keyframes, int rows_each,
                                                    std::size_t constraints, int modes);

/// Rows that a keyframe adds to a session of this scene, at most.
[[nodiscard]] int keyframe_rows(const scene::Scene& scene);
/// Poses of so many keyframes, as displacements and as an edit has them [bytes].
[[nodiscard]] std::uint64_t estimate_pose_bytes(std::size_t keyframes, int nodes, int tets);

}  // namespace limber::server
