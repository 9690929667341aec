#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "engine/beams/model/beam_model.h"

namespace limber::session {

/// The loads and supports of a structure of beams: edits change nothing else. Units as the model's.
struct BeamConditions {
  std::vector<beams::BeamSupport> supports;
  std::vector<beams::PrescribedMotion> motions;
  std::vector<beams::NodalLoad> loads;
  std::vector<beams::DistributedLoad> distributed_loads;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
  /// Temporary loads of one request: they act while its changes are applied. Those that a structure
  /// comes with are not among them: they act where it is solved as drawn.
  std::vector<beams::NodalLoad> temporary_loads;
};

/// Without its temporary loads.
[[nodiscard]] BeamConditions conditions_of(const beams::BeamModel& model);
/// The same nodes, sections and elements under other conditions, with no other temporary loads than
/// theirs; not validated.
[[nodiscard]] beams::BeamModel with_conditions(beams::BeamModel model,
                                               const BeamConditions& conditions);
/// Of memory, about.
[[nodiscard]] std::size_t bytes_of(const BeamConditions& conditions);

}  // namespace limber::session
