#include "engine/rods/linkage/state_numbers.h"

#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/linkage/state_check.h"
#include "engine/rods/linkage/state_slots.h"

namespace limber::rods {

using detail::slot_value;
using detail::write3;

LinkageState::LinkageState(const LinkageModel& model, const StateNumbers& numbers)
    : cells_(model.slots() * kFields) {
  const ReducedVariables& variables = model.variables();
  validate(numbers, model.graph(), variables);
  for (Eigen::Index j = 0; j < numbers.positions.cols(); ++j)
    joints_.push_back(joint_of(numbers, j));
  const auto& batches = model.chains()->batches();
  for (int b = 0; b < static_cast<int>(batches.size()); ++b) {
    for (int lane = 0; lane < kChainLanes; ++lane) {
      if (batches[b].chains[lane] < 0)
        detail::fill_empty_lane(slots(model, b), batches[b].edges, lane);
    }
  }
  Eigen::Index vertex = 0, director = 0, twist = 0;
  for (int s = 0; s < variables.segments(); ++s) {
    const ChainBatches::Place place = model.chains()->place(s);
    const Segment& segment = model.graph().segments[static_cast<std::size_t>(s)];
    double* const own = slots(model, place.batch);
    const int edges = variables.edges(s);
    detail::write_terminals(own, edges, place.lane, segment, joints_);
    for (int i = 0; i <= edges; ++i) {
      if (variables.position(s, i) >= 0)
        write3(own, i, kPosition, place.lane, numbers.vertices.col(vertex++));
    }
    for (int e = 0; e < edges; ++e) {
      if (variables.angle(s, e) >= 0)
        detail::write_director(own, e, place.lane, numbers.directors.col(director++));
    }
    for (int i = 1; i < edges; ++i)
      slot_value(own, i, kTwist, place.lane) = numbers.twists[twist++];
  }
  for (int b = 0; b < static_cast<int>(batches.size()); ++b)
    detail::settle_twists(slots(model, b), batches[b].edges);
}

StateNumbers LinkageState::numbers(const LinkageModel& model) const {
  const ReducedVariables& variables = model.variables();
  const StateSizes counts = state_sizes(variables);
  const auto joints = static_cast<Eigen::Index>(joints_.size());
  StateNumbers numbers;
  for (Eigen::Matrix3Xd* of_joints : {&numbers.positions, &numbers.normals, &numbers.bisectors})
    of_joints->resize(3, joints);
  numbers.opening_angles.resize(joints);
  numbers.lengths.resize(2, joints);
  for (Eigen::Index j = 0; j < joints; ++j) {
    const JointState<double>& joint = joints_[static_cast<std::size_t>(j)];
    numbers.positions.col(j) = joint.position;
    numbers.normals.col(j) = joint.normal;
    numbers.bisectors.col(j) = joint.bisector;
    numbers.opening_angles[j] = joint.opening_angle;
    numbers.lengths.col(j) << joint.lengths[kRodA], joint.lengths[kRodB];
  }
  numbers.vertices.resize(3, counts.vertices);
  numbers.directors.resize(3, counts.directors);
  numbers.twists.resize(counts.twists);
  Eigen::Index vertex_count = 0, director_count = 0, twist_count = 0;
  for (int s = 0; s < variables.segments(); ++s) {
    const int edges = variables.edges(s);
    for (int i = 0; i <= edges; ++i)
      if (variables.position(s, i) >= 0) numbers.vertices.col(vertex_count++) = vertex(model, s, i);
    for (int e = 0; e < edges; ++e)
      if (variables.angle(s, e) >= 0)
        numbers.directors.col(director_count++) = director(model, s, e);
    for (int i = 1; i < edges; ++i) numbers.twists[twist_count++] = twist(model, s, i);
  }
  return numbers;
}

}  // namespace limber::rods
