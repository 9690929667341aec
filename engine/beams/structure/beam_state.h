#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "engine/beams/model/beam_model.h"

namespace limber::beams {

/// Positions and rotations of the nodes. Rotations are composed, never added, so that no attitude
/// is special.
struct BeamState {
  Eigen::Matrix3Xd positions;                   // a column per node [length]
  std::vector<Eigen::Quaterniond> rotations;    // per node, from rest; of unit norm
  std::vector<Eigen::Quaterniond> hinge_turns;  // per released end (BeamStructure), node to beam

  [[nodiscard]] int nodes() const { return static_cast<int>(positions.cols()); }
};

/// The normal of a node as it has turned, of unit length.
[[nodiscard]] Eigen::Vector3d turned_normal(const BeamModel& model, const BeamState& state,
                                            int node);

}  // namespace limber::beams
