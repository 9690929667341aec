#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/beams/model/beam_model.h"

namespace limber::beams {

/// Per node, the resistance to its spins as drawn: a symmetric matrix with the spins that nothing
/// resists for its null space. Beams resist spins but for those about axes that they release there,
/// supports and motions those that they hold; cables none.
/// @pre nodes, elements, supports and motions are valid
[[nodiscard]] std::vector<Eigen::Matrix3d> spin_resistances(const BeamModel& model);

/// The part of a moment that acts along the null space of a node's resistance.
[[nodiscard]] Eigen::Vector3d unresisted(const Eigen::Matrix3d& resistance,
                                         const Eigen::Vector3d& moment);

}  // namespace limber::beams
