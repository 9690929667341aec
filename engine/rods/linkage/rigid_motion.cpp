// A part of a linkage elsewhere, and turned by any angle. As increments of the unknowns turns near
// pi would leave twists in another branch: the edges next to a joint would not know that the others
// turn as far.

#include <cstddef>

#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/linkage/state_slots.h"

namespace limber::rods {
namespace {

JointState<double> carried(const JointState<double>& joint, const Eigen::Isometry3d& motion) {
  JointState<double> result = joint;
  result.position = motion * joint.position;
  result.normal = (motion.linear() * joint.normal).normalized();
  const Eigen::Vector3d bisector = motion.linear() * joint.bisector;
  result.bisector = (bisector - bisector.dot(result.normal) * result.normal).normalized();
  return result;
}

}  // namespace

LinkageState LinkageState::moved_rigidly(const LinkageModel& model, int component,
                                         const Eigen::Isometry3d& motion) const {
  const LinkageGraph& graph = model.graph();
  const ReducedVariables& variables = model.variables();
  const auto is_part = [&](int segment) {
    return graph.segment_components[static_cast<std::size_t>(segment)] == component;
  };
  LinkageState result = *this;
  for (int s = 0; s < variables.segments(); ++s) {
    if (!is_part(s)) continue;
    for (const int joint : graph.segments[static_cast<std::size_t>(s)].joints) {
      if (joint < 0) continue;
      const auto j = static_cast<std::size_t>(joint);
      result.joints_[j] = carried(joints_[j], motion);
    }
  }
  for (int s = 0; s < variables.segments(); ++s) {
    if (!is_part(s)) continue;
    const ChainBatches::Place place = model.chains()->place(s);
    double* const own = result.slots(model, place.batch);
    const int edges = variables.edges(s);
    detail::write_terminals(own, edges, place.lane, graph.segments[static_cast<std::size_t>(s)],
                            result.joints_);
    for (int i = 0; i <= edges; ++i) {
      if (variables.position(s, i) >= 0)
        detail::write3(own, i, kPosition, place.lane, motion * vertex(model, s, i));
    }
    for (int e = 0; e < edges; ++e) {
      if (variables.angle(s, e) >= 0)
        detail::write_director(own, e, place.lane, motion.linear() * director(model, s, e));
    }
  }
  const auto& batches = model.chains()->batches();
  for (int b = 0; b < static_cast<int>(batches.size()); ++b)
    detail::settle_twists(result.slots(model, b), batches[static_cast<std::size_t>(b)].edges);
  return result;
}

}  // namespace limber::rods
