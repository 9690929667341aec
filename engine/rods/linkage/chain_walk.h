#pragma once

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/state_slots.h"
#include "engine/rods/rod/edge_stiffness.h"
#include "engine/rods/rod/vertex_response.h"

// What all passes along the segments of a batch share; each lane is a segment.

namespace limber::rods::detail {

/// Visits the edges of a batch in order, each with the vertices at its ends: each frame and each
/// vertex is computed once.
///   auto edge_at(e)                             what a vertex needs of edge e; called in order
///   auto vertex(e, edge, next)                  the vertex between edges e and e + 1
///   void edge(e, edge, next, before, after)     edge e, its successor, and the vertices at its
///   ends
/// Beyond the segment's ends a vertex is value-initialised; the successor of the last edge is that
/// edge.
/// @pre edges > 0
template <class Walk>
[[gnu::always_inline]] inline void walk_chain(int edges, Walk& walk) {
  auto here = walk.edge_at(0);
  using Vertex = decltype(walk.vertex(0, here, here));
  Vertex before{};
  for (int e = 0; e < edges; ++e) {
    const bool last = e + 1 == edges;
    const auto next = last ? here : walk.edge_at(e + 1);
    const Vertex after = last ? Vertex{} : walk.vertex(e, here, next);
    walk.edge(e, here, next, before, after);
    before = after;
    here = next;
  }
}

/// Stiffnesses of the sections, constant along each segment; T is ChainLane or a Dual of it.
template <class T>
struct ChainStiffness {
  T bending_1, bending_2, torsion;

  /// @param inertia  of the scaled section over that of the section
  [[nodiscard]] static ChainStiffness scaled(const RodStiffness& section, const T& inertia) {
    return {section.bending_1 * inertia, section.bending_2 * inertia, section.torsion * inertia};
  }
  /// Of a vertex that is straight at rest.
  [[nodiscard, gnu::always_inline]] VertexMaterial<T> vertex(
      const LengthWeights<T>& weights) const {
    return {bending_1, bending_2, torsion, weights,
            VertexStrains<T>{T(0.0), T(0.0), T(0.0), T(0.0), T(0.0)}};
  }
};

/// State and parameters of a batch, see LinkageState::slots and LinkageModel::slot_parameters.
struct ChainSlots {
  const double* slots;
  const double* parameters;

  [[nodiscard, gnu::always_inline]] MaterialFrame<ChainLane> frame(int e) const {
    return frame_at(slots, e);
  }
  /// Of a LinkageModel::Field.
  [[nodiscard, gnu::always_inline]] ChainLane parameter(int e, int field) const {
    return load_lane(parameters + (e * LinkageModel::kFields + field) * kChainLanes);
  }
  [[nodiscard, gnu::always_inline]] ChainLane rest_length(int e) const {
    return parameter(e, LinkageModel::kRestLength);
  }
  /// Of the vertex between edges e and e + 1 [rad].
  [[nodiscard, gnu::always_inline]] ChainLane twist_after(int e) const {
    return load_lane(slots + (e + 1) * kSlotStride + LinkageState::kTwist * kChainLanes);
  }
  [[nodiscard]] ChainStiffness<ChainLane> stiffness(const RodStiffness& section) const {
    return ChainStiffness<ChainLane>::scaled(section, parameter(0, LinkageModel::kBending));
  }
};

/// Adds the derivatives by edge e to those by the numbers of the chain. Edges come in order: what
/// only edge e adds to is set, so that only the first vertex needs to be zero before.
[[gnu::always_inline]] inline void add_edge_gradient(double* gradient, int e,
                                                     const EdgeGradient<ChainLane>& by_edge) {
  double* const numbers = gradient + 4 * e * kChainLanes;
  store_lanes3(numbers, load_lanes3(numbers) - by_edge.force);
  store_lane(numbers + 3 * kChainLanes, by_edge.torque);
  store_lanes3(numbers + 4 * kChainLanes, by_edge.force);
}

}  // namespace limber::rods::detail
