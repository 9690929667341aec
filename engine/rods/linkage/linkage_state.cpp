#include "engine/rods/linkage/linkage_state.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/base/rotations/shortest_rotation.h"
#include "engine/rods/linkage/chain_lane.h"
#include "engine/rods/linkage/state_slots.h"
#include "engine/rods/rod/vertex_element.h"
#include "engine/rods/solver/chunk_sizes.h"

namespace limber::rods {
namespace detail {

/// Edges of a joint's rods A and B after an increment.
struct JointEdges {
  std::array<Eigen::Vector3d, 2> tangents;
  std::array<double, 2> turns;  // of the frames, beyond their transport [rad]
};

}  // namespace detail
namespace {

using detail::ChainLane;
using detail::fill_empty_lane;
using detail::frame_at;
using detail::JointEdges;
using detail::kSlotStride;
using detail::load_lane;
using detail::load_lanes3;
using detail::read3;
using detail::settle_twists;
using detail::store_lane;
using detail::store_lanes3;
using detail::write3;
using detail::write_terminal;

/// Interior vertices of a drawn segment, one lane: straight, and the twist between its ends spread
/// by length.
class Drawing {
 public:
  Drawing(double* slots, const ChainBatch& batch, int lane)
      : slots_(slots), batch_(batch), lane_(lane) {}

  void straighten(const Eigen::Vector3d& start, const Eigen::Vector3d& finish) {
    const int first = batch_.has_start ? 1 : 0;
    const int last = batch_.edges - (batch_.has_finish ? 1 : 0);
    const Eigen::Vector3d from = batch_.has_start ? position(1) : start;
    const Eigen::Vector3d to = batch_.has_finish ? position(last) : finish;
    for (int i = first; i <= last; ++i) {
      const double t = static_cast<double>(i - first) / (last - first);
      write3(slots_, i, LinkageState::kPosition, lane_, from + t * (to - from));
    }
  }

  void spread_twist() {
    const int edges = batch_.edges;
    const Eigen::Vector3d given = director(edges - 1);
    std::vector<Eigen::Vector3d> carried;
    Eigen::Vector3d current = batch_.has_start ? director(0) : tangent(0).unitOrthogonal();
    std::vector<double> lengths = {0};
    for (int e = 0; e < edges; ++e) {
      if (e > 0) {
        current = rotations::shortest_rotation(tangent(e - 1), tangent(e)) * current;
        lengths.push_back(lengths.back() + (length(e - 1) + length(e)) / 2);
      }
      carried.push_back(current);
    }
    double turn = 0;
    if (batch_.has_finish) {
      turn = std::atan2(tangent(edges - 1).dot(current.cross(given)), current.dot(given));
    }
    const double total = edges > 1 ? lengths.back() : 1;
    for (int e = 0; e < edges; ++e) {
      const double share = batch_.has_start ? lengths[e] / total : 1;
      write3(slots_, e, LinkageState::kDirector, lane_,
             Eigen::AngleAxisd(turn * share, tangent(e)) * carried[e]);
      const double own =
          e == 0 || !batch_.has_start ? 0 : turn * (lengths[e] - lengths[e - 1]) / total;
      slots_[e * kSlotStride + LinkageState::kTwist * kChainLanes + lane_] = own;
    }
  }

 private:
  Eigen::Vector3d position(int i) const { return read3(slots_, i, LinkageState::kPosition, lane_); }
  Eigen::Vector3d director(int e) const { return read3(slots_, e, LinkageState::kDirector, lane_); }
  double length(int e) const { return (position(e + 1) - position(e)).norm(); }
  Eigen::Vector3d tangent(int e) const { return (position(e + 1) - position(e)).normalized(); }

  double* slots_;
  const ChainBatch& batch_;
  int lane_;
};

/// Moves the vertices and edges of one lane that are no joint's; angles go to `turns`.
void move_chain(double* slots, const ChainBatch& batch, int lane, const double* increment,
                double* turns) {
  for (int number = batch.begin(); number < batch.end(); ++number, ++increment) {
    // Four numbers: three of a vertex and one of the edge behind it.
    double* const slot = slots + number / 4 * kSlotStride + lane;
    if (number % 4 == 0 && number + 4 <= batch.end()) {
      for (int axis = 0; axis < 3; ++axis) slot[axis * kChainLanes] += increment[axis];
      turns[number / 4 * kChainLanes + lane] = increment[3];
      number += 3;
      increment += 3;
    } else if (number % 4 == 3) {
      turns[number / 4 * kChainLanes + lane] = *increment;
    } else {
      slot[number % 4 * kChainLanes] += *increment;
    }
  }
}

/// The frame of an edge that is no joint's, from the slots before to those after.
MaterialFrame<ChainLane> transport_frame(const double* before, const double* turns, double* after,
                                         int edge) {
  const MaterialFrame<ChainLane> old = frame_at(before, edge);
  double* const slot = after + edge * kSlotStride;
  auto frame = material_frame(load_lanes3(slot), load_lanes3(slot + kSlotStride),
                              load_lane(turns + edge * kChainLanes), old.tangent, old.d1);
  // Orthonormal to rounding however often the frame has moved.
  const Vec3<ChainLane> across = frame.d1 - dot(frame.d1, frame.tangent) * frame.tangent;
  frame.d1 = (1.0 / norm(across)) * across;
  frame.d2 = cross(frame.tangent, frame.d1);
  store_lanes3(slot + LinkageState::kDirector * kChainLanes, frame.d1);
  return frame;
}

/// Frames of all edges but the joints', and twists: those in the branch next to what the angles
/// alone would make.
void transport_frames(const ChainBatch& batch, const double* before, const double* turns,
                      double* after) {
  const int first = batch.has_start ? 1 : 0;
  const int last = batch.edges - (batch.has_finish ? 1 : 0);
  MaterialFrame<ChainLane> previous{};
  for (int e = 0; e < batch.edges; ++e) {
    const MaterialFrame<ChainLane> frame =
        e >= first && e < last ? transport_frame(before, turns, after, e) : frame_at(after, e);
    if (e > 0) {
      double* const cell = after + e * kSlotStride + LinkageState::kTwist * kChainLanes;
      const ChainLane expected = load_lane(cell) + load_lane(turns + e * kChainLanes) -
                                 load_lane(turns + (e - 1) * kChainLanes);
      store_lane(cell, material_twist(previous, frame, expected));
    }
    previous = frame;
  }
}

}  // namespace

LinkageState::LinkageState(const LinkageModel& model) : cells_(model.slots() * kFields) {
  const LinkageGraph& graph = model.graph();
  const RestLengths& rest = model.rest_lengths();
  for (std::size_t j = 0; j < graph.joints.size(); ++j) {
    const Joint& joint = graph.joints[j];
    joints_.push_back({joint.position,
                       joint.normal,
                       joint.bisector,
                       joint.opening_angle,
                       {rest.terminal(kRodA, static_cast<Eigen::Index>(j)),
                        rest.terminal(kRodB, static_cast<Eigen::Index>(j))}});
  }
  for (int b = 0; b < static_cast<int>(model.chains()->batches().size()); ++b) {
    const ChainBatch& batch = model.chains()->batches()[b];
    double* const own = slots(model, b);
    for (int lane = 0; lane < kChainLanes; ++lane) {
      if (batch.chains[lane] < 0) {
        fill_empty_lane(own, batch.edges, lane);
        continue;
      }
      const Segment& segment = graph.segments[batch.chains[lane]];
      detail::write_terminals(own, batch.edges, lane, segment, joints_);
      Drawing drawing(own, batch, lane);
      drawing.straighten(segment.points[kStart], segment.points[kFinish]);
      drawing.spread_twist();
    }
    settle_twists(own, batch.edges);
  }
}

LinkageState LinkageState::moved(const LinkageModel& model,
                                 const Eigen::Ref<const Eigen::VectorXd>& increment,
                                 Parts parts) const {
  const ChainBatches& chains = *model.chains();
  LIMBER_DEMAND(increment.size() == chains.size());
  LinkageState result = *this;
  std::vector<JointEdges> joint_edges(joints_.size());
  parallel_for(chains.joints(), detail::kJointsPerChunk, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) {
      const int j = static_cast<int>(i);
      const JointIncrement<double> change =
          increment.segment<kJointUnknowns>(chains.joint_begin(j));
      result.joints_[j] = advanced(joints_[j], change);
      joint_edges[j].tangents = result.joints_[j].tangents();
      if (parts == Parts::kVertices) continue;
      const detail::JointTurn<double> turn(joints_[j].normal, change);
      const auto before = joints_[j].tangents();
      for (const RodOfJoint rod : {kRodA, kRodB})
        joint_edges[j].turns[rod] = detail::twist_about(turn.of(rod), before[rod]);
    }
  });
  parallel_for(static_cast<std::int64_t>(chains.batches().size()), detail::kBatchesPerChunk,
               [&](std::int64_t begin, std::int64_t end) {
                 std::vector<double> turns;
                 for (std::int64_t b = begin; b < end; ++b) {
                   const int batch = static_cast<int>(b);
                   double* const own = result.slots(model, batch);
                   result.place_batch(model, batch, joint_edges, increment, turns);
                   if (parts == Parts::kVertices) continue;
                   transport_frames(chains.batches()[batch], slots(model, batch), turns.data(),
                                    own);
                 }
               });
  return result;
}

void LinkageState::place_batch(const LinkageModel& model, int index,
                               const std::vector<JointEdges>& joint_edges,
                               const Eigen::Ref<const Eigen::VectorXd>& increment,
                               std::vector<double>& turns) {
  const ChainBatches& chains = *model.chains();
  const ChainBatch& batch = chains.batches()[index];
  double* const own = slots(model, index);
  turns.assign(static_cast<std::size_t>(batch.edges) * kChainLanes, 0.0);
  for (int lane = 0; lane < kChainLanes; ++lane) {
    const int chain = batch.chains[lane];
    if (chain < 0) continue;
    move_chain(own, batch, lane, increment.data() + chains.chain_begin(chain), turns.data());
    const Segment& segment = model.graph().segments[chain];
    for (const End end : {kStart, kFinish}) {
      const int joint = segment.joints[end];
      if (joint < 0) continue;
      const int edge = end == kStart ? 0 : batch.edges - 1;
      const RodOfJoint rod = segment.rods[end];
      write_terminal(own, edge, lane, joints_[joint], rod,
                     segment.signs[end] * joint_edges[joint].tangents[rod]);
      turns[edge * kChainLanes + lane] = segment.signs[end] * joint_edges[joint].turns[rod];
    }
  }
}

double LinkageState::value(const LinkageModel& model, int segment, int slot, int field) const {
  const ChainBatches::Place place = model.chains()->place(segment);
  return slots(model, place.batch)[slot * kSlotStride + field * kChainLanes + place.lane];
}

Eigen::Vector3d LinkageState::vertex(const LinkageModel& model, int segment, int index) const {
  return {value(model, segment, index, kPosition), value(model, segment, index, kPosition + 1),
          value(model, segment, index, kPosition + 2)};
}
Eigen::Vector3d LinkageState::director(const LinkageModel& model, int segment, int edge) const {
  return {value(model, segment, edge, kDirector), value(model, segment, edge, kDirector + 1),
          value(model, segment, edge, kDirector + 2)};
}
double LinkageState::twist(const LinkageModel& model, int segment, int vertex) const {
  return value(model, segment, vertex, kTwist);
}

double LinkageState::mean_opening_angle() const {
  if (joints_.empty()) return 0;
  double sum = 0;
  for (const JointState<double>& joint : joints_) sum += joint.opening_angle;
  return sum / static_cast<double>(joints_.size());
}

}  // namespace limber::rods
