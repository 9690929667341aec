#include "engine/beams/structure/beam_state.h"

namespace limber::beams {

Eigen::Vector3d turned_normal(const BeamModel& model, const BeamState& state, int node) {
  const auto n = static_cast<std::size_t>(node);
  return state.rotations[n] * model.nodes[n].normal.normalized();
}

}  // namespace limber::beams
