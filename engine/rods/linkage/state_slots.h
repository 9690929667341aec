#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "engine/rods/linkage/chain_lane.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/linkage/terminal_edge.h"
#include "engine/rods/rod/vertex_element.h"

// Layout of a batch of segments in LinkageState: by slot (a vertex and the edge after it), and in a
// slot by field, each with a lane for every segment.

namespace limber::rods::detail {

constexpr std::ptrdiff_t kSlotStride = LinkageState::kFields * kChainLanes;

inline double& slot_value(double* slots, int slot, int field, int lane) {
  return slots[slot * kSlotStride + field * kChainLanes + lane];
}

/// A field of three numbers of one lane.
inline void write3(double* slots, int slot, int field, int lane, const Eigen::Vector3d& v) {
  for (int axis = 0; axis < 3; ++axis) slot_value(slots, slot, field + axis, lane) = v[axis];
}
inline Eigen::Vector3d read3(const double* slots, int slot, int field, int lane) {
  const double* const first = slots + slot * kSlotStride + field * kChainLanes + lane;
  return {first[0], first[kChainLanes], first[2 * kChainLanes]};
}

/// Places a segment's terminal edge.
inline void write_terminal(double* slots, int first_slot, int lane, const JointState<double>& joint,
                           RodOfJoint rod, const Eigen::Vector3d& tangent) {
  const Eigen::Vector3d half = tangent * (joint.lengths[rod] / 2);
  write3(slots, first_slot, LinkageState::kPosition, lane, joint.position - half);
  write3(slots, first_slot + 1, LinkageState::kPosition, lane, joint.position + half);
  write3(slots, first_slot, LinkageState::kDirector, lane, joint.normal.cross(tangent));
}

/// Those at its joints.
inline void write_terminals(double* slots, int edges, int lane, const Segment& segment,
                            const std::vector<JointState<double>>& joints) {
  for (const End end : {kStart, kFinish}) {
    if (segment.joints[end] < 0) continue;
    const JointState<double>& joint = joints[static_cast<std::size_t>(segment.joints[end])];
    const RodOfJoint rod = segment.rods[end];
    write_terminal(slots, end == kStart ? 0 : edges - 1, lane, joint, rod,
                   segment.signs[end] * joint.tangent(rod));
  }
}

/// Makes it a unit vector across the edge.
/// @pre both of the edge's vertices are placed
inline void write_director(double* slots, int edge, int lane, const Eigen::Vector3d& director) {
  const Eigen::Vector3d tangent = (read3(slots, edge + 1, LinkageState::kPosition, lane) -
                                   read3(slots, edge, LinkageState::kPosition, lane))
                                      .normalized();
  write3(slots, edge, LinkageState::kDirector, lane,
         (director - director.dot(tangent) * tangent).normalized());
}

[[gnu::always_inline]] inline MaterialFrame<ChainLane> frame_at(const double* slots, int edge) {
  const double* const own = slots + edge * kSlotStride;
  const Vec3<ChainLane> e = load_lanes3(own + kSlotStride) - load_lanes3(own);
  const ChainLane length = norm(e);
  const Vec3<ChainLane> tangent = (1.0 / length) * e;
  const Vec3<ChainLane> d1 = load_lanes3(own + LinkageState::kDirector * kChainLanes);
  return {tangent, length, d1, cross(tangent, d1), {}};
}

/// Moves twists into the branch nearest to the present values.
inline void settle_twists(double* slots, int edges) {
  MaterialFrame<ChainLane> before = frame_at(slots, 0);
  for (int i = 1; i < edges; ++i) {
    const MaterialFrame<ChainLane> after = frame_at(slots, i);
    double* const cell = slots + i * kSlotStride + LinkageState::kTwist * kChainLanes;
    store_lane(cell, material_twist(before, after, load_lane(cell)));
    before = after;
  }
}

/// An empty lane holds a straight rod, so that nothing in it is NaN.
inline void fill_empty_lane(double* slots, int edges, int lane) {
  for (int i = 0; i <= edges; ++i) {
    write3(slots, i, LinkageState::kPosition, lane, i * Eigen::Vector3d::UnitX());
    write3(slots, i, LinkageState::kDirector, lane, Eigen::Vector3d::UnitY());
  }
}

}  // namespace limber::rods::detail
