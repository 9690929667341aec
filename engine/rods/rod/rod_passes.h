#pragma once

#include "engine/base/parallel.h"
#include "engine/rods/rod/edge_stiffness.h"
#include "engine/rods/rod/rod_parameters.h"
#include "engine/rods/rod/source_frames.h"
#include "engine/rods/rod/stretch_element.h"
#include "engine/rods/rod/vertex_response.h"

// The sweeps over the slots of a layout that rod_state.cpp, rod_hessian.cpp and rod_derivatives.cpp
// are made of; V is Lane, or Dual<Lane> for derivatives along a direction. A sweep writes its own
// rows only, so chunks run in parallel and results do not depend on how many do.

namespace limber::rods::passes {

enum FrameField { kTangent = 0, kLength = 3, kD1 = 4, kD2 = 7, kTransport = 10, kFrameFields = 13 };
enum EnergyField { kStretchEnergy, kBendEnergy, kTwistEnergy, kEnergyFields };
enum BlockField {
  kEdgeEe = 0,
  kEdgeEt = 6,
  kEdgeTt = 9,
  kCrossEe = 10,
  kCrossEt = 19,
  kCrossTe = 22,
  kCrossTt = 25,
  kBlockFields = 26
};
enum class Transport { kNone, kFinite };

/// Calls work(row) for the first row of every register of slots.
template <class Work>
void sweep(const RodLayout& layout, Work&& work) {
  constexpr std::int64_t kGrain = 128;  // registers: some 20 microseconds of work
  const std::int64_t registers = (layout.nodes() + kLaneWidth - 1) / kLaneWidth;
  parallel_for(registers, kGrain, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) work(i * kLaneWidth);
  });
}

template <class V>
[[gnu::always_inline]] inline MaterialFrame<V> load_frame(const SlotsIn& frames,
                                                          std::ptrdiff_t row) {
  return {load3<V>(frames, kTangent, row), load<V>(frames, kLength, row),
          load3<V>(frames, kD1, row), load3<V>(frames, kD2, row),
          load3<V>(frames, kTransport, row)};
}

/// unknowns (4 columns) -> frames. If there is no edge, the frame is any numbers.
template <class V>
void frames(const RodLayout& layout, const SlotsIn& source, const SlotsIn& unknowns,
            const SlotsOut& out) {
  sweep(layout, [&](std::ptrdiff_t row) {
    const auto frame =
        material_frame<V>(load3<V>(unknowns, 0, row), load3<V>(unknowns, 0, row + 1),
                          load<V>(unknowns, 3, row), load3<V>(source, SourceFrames::kTangent, row),
                          load3<V>(source, SourceFrames::kDirector, row));
    store(out, kTangent, row, frame.tangent);
    store(out, kLength, row, frame.length);
    store(out, kD1, row, frame.d1);
    store(out, kD2, row, frame.d2);
    store(out, kTransport, row, frame.transport);
  });
}

/// frames -> twist of the material frame at every interior vertex, one column.
template <class V>
void twists(const RodLayout& layout, const SlotsIn& source, const SlotsIn& unknowns,
            const SlotsIn& frames, const SlotsOut& out) {
  const SlotsIn active{&layout.activity(), nullptr};
  sweep(layout, [&](std::ptrdiff_t row) {
    const V expected = load<V>(unknowns, 3, row + 1) - load<V>(unknowns, 3, row) +
                       load<V>(source, SourceFrames::kTwist, row + 1);
    const V twist =
        material_twist(load_frame<V>(frames, row), load_frame<V>(frames, row + 1), expected);
    store(out, 0, row + 1, where_active(load<Lane>(active, 1, row + 1), twist));
  });
}

/// frames and twists -> one column: zero where frames and strains are finite, NaN where not.
inline void finiteness(const RodLayout& layout, const SlotsIn& frames, const SlotsIn& twists,
                       const SlotsOut& out) {
  const SlotsIn active{&layout.activity(), nullptr};
  sweep(layout, [&](std::ptrdiff_t row) {
    const auto before = load_frame<Lane>(frames, row);
    const auto after = load_frame<Lane>(frames, row + 1);
    const Vec3<Lane> edge = before.tangent + before.d1 + before.d2 + before.transport;
    const auto s = vertex_kinematics(before, after, load<Lane>(twists, 0, row + 1)).strains;
    const Lane vertex = s.before_1 + s.before_2 + s.after_1 + s.after_2 + s.twist;
    store(
        out, 0, row,
        where_active(load<Lane>(active, 0, row), 0.0 * (edge.x + edge.y + edge.z + before.length)) +
            where_active(load<Lane>(active, 1, row + 1), 0.0 * vertex));
  });
}

/// frames and twists -> source frames there: directors are turned back by theta, and made
/// orthogonal, so that they stay so to rounding however often sources have moved.
inline void sources(const RodLayout& layout, const SlotsIn& unknowns, const SlotsIn& frames,
                    const SlotsIn& twists, const SlotsOut& out) {
  const SlotsIn active{&layout.activity(), nullptr};
  sweep(layout, [&](std::ptrdiff_t row) {
    const auto frame = load_frame<Lane>(frames, row);
    const Lane theta = load<Lane>(unknowns, 3, row);
    const auto k = rotations::cosine_sine(theta);
    Vec3<Lane> director = k.cosine * frame.d1 - k.sine * frame.d2;
    director -= dot(director, frame.tangent) * frame.tangent;
    const Lane has_edge = load<Lane>(active, 0, row);
    store(out, SourceFrames::kTangent, row, where_active(has_edge, frame.tangent));
    store(out, SourceFrames::kDirector, row,
          where_active(has_edge, (1.0 / norm(director)) * director));
    store(
        out, SourceFrames::kTwist, row + 1,
        where_active(load<Lane>(active, 1, row + 1),
                     load<Lane>(twists, 0, row + 1) - (load<Lane>(unknowns, 3, row + 1) - theta)));
  });
}

/// Material of the vertex between the edges of slots row and row + 1.
template <class V>
[[gnu::always_inline]] inline VertexMaterial<V> load_material(const SlotsIn& parameters,
                                                              BendingForm form,
                                                              std::ptrdiff_t row) {
  using P = RodParameters;
  const std::ptrdiff_t node = row + 1;
  return {load<V>(parameters, P::kBending1, node),
          load<V>(parameters, P::kBending2, node),
          load<V>(parameters, P::kTorsion, node),
          length_weights(load<V>(parameters, P::kRestLength, row),
                         load<V>(parameters, P::kRestLength, node), form),
          {load<V>(parameters, P::kRestBefore1, node), load<V>(parameters, P::kRestBefore2, node),
           load<V>(parameters, P::kRestAfter1, node), load<V>(parameters, P::kRestAfter2, node),
           load<V>(parameters, P::kRestTwist, node)}};
}

/// Results of a sweep over vertices: moments (3) and stiffnesses (6; may be absent) per vertex.
struct VertexOut {
  SlotsOut moments;
  SlotsOut stiffnesses;
  SlotArray* energies = nullptr;  // kBendEnergy and kTwistEnergy; absent with stiffnesses
};

template <class V, CurvatureMeasure kMeasure>
void vertices_as(const RodLayout& layout, const SlotsIn& parameters, BendingForm form,
                 const SlotsIn& frames, const SlotsIn& twists, const VertexOut& out) {
  const SlotsIn active{&layout.activity(), nullptr};
  sweep(layout, [&](std::ptrdiff_t row) {
    const auto before = load_frame<V>(frames, row);
    const auto after = load_frame<V>(frames, row + 1);
    const auto material = load_material<V>(parameters, form, row);
    const V twist = load<V>(twists, 0, row + 1);
    const Lane interior = load<Lane>(active, 1, row + 1);
    if (out.stiffnesses.value) {
      const auto response =
          vertex_response<VertexOrder::kStiffness, kMeasure>(before, after, twist, material);
      store(out.moments, 0, row + 1, where_active(interior, response.moment));
      store(out.stiffnesses, 0, row + 1, where_active(interior, response.stiffness));
      return;
    }
    const auto response =
        vertex_response<VertexOrder::kMoment, kMeasure>(before, after, twist, material);
    store(out.moments, 0, row + 1, where_active(interior, response.moment));
    if constexpr (std::is_same_v<V, Lane>) {
      if (!out.energies) return;
      const SlotsOut energies{out.energies, nullptr};
      store(energies, kBendEnergy, row + 1, where_active(interior, response.energy.bending));
      store(energies, kTwistEnergy, row + 1, where_active(interior, response.energy.twisting));
    }
  });
}

template <class V>
void vertices(const RodLayout& layout, const SlotsIn& parameters, BendingForm form,
              const SlotsIn& frames, const SlotsIn& twists, const VertexOut& out) {
  if (measure_of(form) == CurvatureMeasure::kAngle) {
    vertices_as<V, CurvatureMeasure::kAngle>(layout, parameters, form, frames, twists, out);
  } else {
    vertices_as<V, CurvatureMeasure::kTangent>(layout, parameters, form, frames, twists, out);
  }
}

/// moments -> derivatives by e (3) and theta (1) of every edge, and its stretching energy.
template <class V>
void edge_gradients(const RodLayout& layout, const SlotsIn& parameters, const SlotsIn& frames,
                    const SlotsIn& moments, const SlotsOut& out, SlotArray* energies) {
  const SlotsIn active{&layout.activity(), nullptr};
  sweep(layout, [&](std::ptrdiff_t row) {
    const auto edge = load_frame<V>(frames, row);
    const auto s = stretch(edge.length, load<V>(parameters, RodParameters::kRestLength, row),
                           load<V>(parameters, RodParameters::kStretching, row));
    const auto gradient =
        edge_gradient(edge, load3<V>(moments, 0, row) - load3<V>(moments, 0, row + 1), s.tension);
    const Lane has_edge = load<Lane>(active, 0, row);
    store(out, 0, row, where_active(has_edge, gradient.force));
    store(out, 3, row, where_active(has_edge, gradient.torque));
    if constexpr (std::is_same_v<V, Lane>) {
      if (energies)
        store({energies, nullptr}, kStretchEnergy, row, where_active(has_edge, s.energy));
    }
  });
}

/// moments and stiffnesses -> Hessian blocks of every edge, and of it with the next.
template <class V, Transport kTransportation>
void blocks(const RodLayout& layout, const SlotsIn& source, const SlotsIn& parameters,
            const SlotsIn& frames, const SlotsIn& moments, const SlotsIn& stiffnesses,
            const SlotsOut& out) {
  const SlotsIn active{&layout.activity(), nullptr};
  sweep(layout, [&](std::ptrdiff_t row) {
    const auto edge = load_frame<V>(frames, row);
    const auto next = load_frame<V>(frames, row + 1);
    const Vec3<V> vertex_moment = load3<V>(moments, 0, row + 1);
    const Sym3<V> vertex_stiffness = load6<V>(stiffnesses, 0, row + 1);
    const Vec3<V> moment = load3<V>(moments, 0, row) - vertex_moment;
    auto own = edge_block(edge, moment, load6<V>(stiffnesses, 0, row) + vertex_stiffness);
    auto cross = cross_block(edge, next, vertex_moment, vertex_stiffness);
    if constexpr (kTransportation == Transport::kFinite) {
      own = transported(own, edge, load3<V>(source, SourceFrames::kTangent, row),
                        dot(moment, edge.tangent));
      cross = transported(cross, edge.transport, next.transport);
    }
    const auto s = stretch(edge.length, load<V>(parameters, RodParameters::kRestLength, row),
                           load<V>(parameters, RodParameters::kStretching, row));
    own.ee += stretch_stiffness(s, edge.tangent, edge.length);
    const Lane has_edge = load<Lane>(active, 0, row);
    store(out, kEdgeEe, row, where_active(has_edge, own.ee));
    store(out, kEdgeEt, row, where_active(has_edge, own.et));
    store(out, kEdgeTt, row, where_active(has_edge, own.tt));
    const Lane interior = load<Lane>(active, 1, row + 1);
    for (int c = 0; c < 3; ++c)
      store(out, kCrossEe + 3 * c, row, where_active(interior, cross.ee.column[c]));
    store(out, kCrossEt, row, where_active(interior, cross.et));
    store(out, kCrossTe, row, where_active(interior, cross.te));
    store(out, kCrossTt, row, where_active(interior, cross.tt));
  });
}

/// Derivatives by e and theta of edges -> by the unknowns of the layout.
[[nodiscard]] inline Eigen::VectorXd gather(const RodLayout& layout, const SlotArray& edges) {
  Eigen::VectorXd result(layout.unknowns());
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (int slot = 0; slot < layout.nodes(); ++slot) {
    const Eigen::Vector3d after = edges.row(slot).head<3>();
    result.segment<3>(4 * slot) = before - after;
    result[4 * slot + 3] = edges(slot, 3);
    before = after;
  }
  return result;
}

/// Array for a sweep to write; entries that it does not write are zero.
[[nodiscard]] inline SlotArray slots(const RodLayout& layout, int fields) {
  return SlotArray::Zero(layout.rows(), fields);
}

}  // namespace limber::rods::passes
