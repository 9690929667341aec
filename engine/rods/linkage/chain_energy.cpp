#include "engine/rods/linkage/chain_energy.h"

#include <algorithm>

#include "engine/rods/linkage/chain_lane.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/rod/edge_stiffness.h"
#include "engine/rods/rod/stretch_element.h"
#include "engine/rods/rod/vertex_response.h"

namespace limber::rods::detail {
namespace {

using V = ChainLane;
enum class Order { kEnergy, kGradient, kHessian };

/// The vertex between two edges, as the edges see it.
struct VertexResult {
  Vec3<V> moment;
  Sym3<V> stiffness;
};

/// Writes to a band column by column: entry(row, column) of the numbers from `first` on. Edges come
/// in order, each before its vertex with the next. Entries that nothing has been added to are set.
/// Therefore only the columns of the first edge and those behind the last one need to be zero
/// before.
class BandWriter {
 public:
  BandWriter(double* band, int first) : band_(band + first * kBandHeight * kChainLanes) {}

  [[gnu::always_inline]] void add(int row, int column, const V& value) const {
    double* const cell = band_ + (column * kBandHeight + row - column) * kChainLanes;
    store_lane(cell, load_lane(cell) + value);
  }
  [[gnu::always_inline]] void set(int row, int column, const V& value) const {
    store_lane(band_ + (column * kBandHeight + row - column) * kChainLanes, value);
  }

  /// Second derivatives by e and theta of one edge, numbers 0 to 6.
  [[gnu::always_inline]] void add_edge(const EdgeBlock<V>& block) const {
    const V ee[3][3] = {{block.ee.xx, block.ee.yx, block.ee.zx},
                        {block.ee.yx, block.ee.yy, block.ee.zy},
                        {block.ee.zx, block.ee.zy, block.ee.zz}};
    const V et[3] = {block.et.x, block.et.y, block.et.z};
    for (int c = 0; c < 3; ++c) {
      for (int r = c; r < 3; ++r) add(r, c, ee[r][c]);
      add(3, c, -et[c]);
      for (int r = 0; r < 3; ++r) add(4 + r, c, -ee[r][c]);
    }
    set(3, 3, block.tt);
    for (int r = 0; r < 3; ++r) set(4 + r, 3, et[r]);
    for (int c = 0; c < 3; ++c) {
      for (int r = c; r < 3; ++r) set(4 + r, 4 + c, ee[r][c]);
    }
  }

  /// Adds the block of an edge with the next, numbers 0 to 10.
  [[gnu::always_inline]] void add_cross(const CrossBlock<V>& block) const {
    const V et[3] = {block.et.x, block.et.y, block.et.z};
    const V te[3] = {block.te.x, block.te.y, block.te.z};
    V ee[3][3];  // [row: e before][column: e after]
    for (int c = 0; c < 3; ++c) {
      ee[0][c] = block.ee.column[c].x;
      ee[1][c] = block.ee.column[c].y;
      ee[2][c] = block.ee.column[c].z;
    }
    for (int c = 0; c < 3; ++c) {
      for (int r = 0; r < 3; ++r) add(4 + r, c, ee[c][r]);
      set(7, c, -et[c]);
      for (int r = 0; r < 3; ++r) set(8 + r, c, -ee[c][r]);
    }
    for (int r = 0; r < 3; ++r) add(4 + r, 3, -te[r]);
    set(7, 3, block.tt);
    for (int r = 0; r < 3; ++r) set(8 + r, 3, te[r]);
    for (int c = 0; c < 3; ++c) {
      for (int r = c; r < 3; ++r) add(4 + r, 4 + c, -ee[r][c] - ee[c][r]);
      set(7, 4 + c, et[c]);
      for (int r = 0; r < 3; ++r) set(8 + r, 4 + c, ee[c][r]);
    }
  }

 private:
  double* band_;
};

/// Walks along the segments of a batch, edge by edge.
template <Order kOrder, CurvatureMeasure kMeasure>
class Walk {
 public:
  Walk(const double* slots, const double* parameters, const RodStiffness& stiffness,
       BendingForm form, const ChainOutputs& out)
      : slots_(slots), parameters_(parameters), form_(form), out_(out) {
    const V scale = parameter(0, LinkageModel::kBending);
    bending_1_ = stiffness.bending_1 * scale;
    bending_2_ = stiffness.bending_2 * scale;
    torsion_ = stiffness.torsion * scale;
  }

  void run(int edges) {
    MaterialFrame<V> frame = frame_of(0);
    VertexResult before{};
    for (int e = 0; e < edges; ++e) {
      const MaterialFrame<V> next = e + 1 < edges ? frame_of(e + 1) : frame;
      const VertexResult after = e + 1 < edges ? vertex(e, frame, next) : VertexResult{};
      edge(e, frame, before, after);
      if constexpr (kOrder == Order::kHessian) {
        if (e + 1 < edges) {
          BandWriter(out_.band, 4 * e)
              .add_cross(cross_block(frame, next, after.moment, after.stiffness));
        }
      }
      before = after;
      frame = next;
    }
    store_lane(out_.energies, stretching_);
    store_lane(out_.energies + kChainLanes, bending_);
    store_lane(out_.energies + 2 * kChainLanes, twisting_);
  }

 private:
  [[gnu::always_inline]] MaterialFrame<V> frame_of(int e) const {
    const double* const slot = slots_ + e * LinkageState::kFields * kChainLanes;
    const Vec3<V> difference =
        load_lanes3(slot + LinkageState::kFields * kChainLanes) - load_lanes3(slot);
    const V length = norm(difference);
    const Vec3<V> tangent = (1.0 / length) * difference;
    const Vec3<V> d1 = load_lanes3(slot + LinkageState::kDirector * kChainLanes);
    return {tangent, length, d1, cross(tangent, d1), {}};
  }
  [[gnu::always_inline]] V parameter(int e, int field) const {
    return load_lane(parameters_ + (e * LinkageModel::kFields + field) * kChainLanes);
  }

  /// The vertex after edge e.
  [[gnu::always_inline]] VertexResult vertex(int e, const MaterialFrame<V>& frame,
                                             const MaterialFrame<V>& next) {
    VertexMaterial<V> material{bending_1_, bending_2_, torsion_,
                               length_weights(parameter(e, LinkageModel::kRestLength),
                                              parameter(e + 1, LinkageModel::kRestLength), form_),
                               VertexStrains<V>{V(0.0), V(0.0), V(0.0), V(0.0), V(0.0)}};
    const V twist =
        load_lane(slots_ + ((e + 1) * LinkageState::kFields + LinkageState::kTwist) * kChainLanes);
    constexpr VertexOrder kVertexOrder = kOrder == Order::kEnergy     ? VertexOrder::kEnergy
                                         : kOrder == Order::kGradient ? VertexOrder::kMoment
                                                                      : VertexOrder::kStiffness;
    if constexpr (kOrder == Order::kHessian) {
      if (out_.compression == Compression::kUnstressed)
        material.rest =
            vertex_response<VertexOrder::kEnergy, kMeasure>(frame, next, twist, material).strains;
    }
    const auto response = vertex_response<kVertexOrder, kMeasure>(frame, next, twist, material);
    bending_ += response.energy.bending;
    twisting_ += response.energy.twisting;
    return {response.moment, response.stiffness};
  }

  [[gnu::always_inline]] void edge(int e, const MaterialFrame<V>& frame, const VertexResult& before,
                                   const VertexResult& after) {
    auto s = stretch(frame.length, parameter(e, LinkageModel::kRestLength),
                     parameter(e, LinkageModel::kStretching));
    if constexpr (kOrder == Order::kHessian) {
      if (out_.tensions != nullptr) s.tension = load_lane(out_.tensions + e * kChainLanes);
      if (out_.compression == Compression::kUnstressed) s.energy = s.tension = V(0.0);
    }
    stretching_ += s.energy;
    if constexpr (kOrder != Order::kEnergy) {
      const Vec3<V> moment = before.moment - after.moment;
      const auto gradient = edge_gradient(frame, moment, s.tension);
      double* const numbers = out_.gradient + 4 * e * kChainLanes;
      store_lanes3(numbers, load_lanes3(numbers) - gradient.force);
      store_lane(numbers + 3 * kChainLanes, gradient.torque);
      store_lanes3(numbers + 4 * kChainLanes, gradient.force);
      if constexpr (kOrder == Order::kHessian) {
        EdgeBlock<V> block = edge_block(frame, moment, before.stiffness + after.stiffness);
        auto stiff = s;
        if (out_.compression == Compression::kLeftOut) stiff.tension = max(s.tension, V(0.0));
        block.ee += stretch_stiffness(stiff, frame.tangent, frame.length);
        BandWriter(out_.band, 4 * e).add_edge(block);
      }
    }
  }

  const double* slots_;
  const double* parameters_;
  BendingForm form_;
  const ChainOutputs& out_;
  V bending_1_, bending_2_, torsion_;  // alike along a segment
  V stretching_ = 0.0, bending_ = 0.0, twisting_ = 0.0;
};

template <CurvatureMeasure kMeasure>
void evaluate_as(const ChainBatch& batch, const double* slots, const double* parameters,
                 const RodStiffness& stiffness, BendingForm form, const ChainOutputs& out) {
  if (out.band != nullptr) {
    Walk<Order::kHessian, kMeasure>(slots, parameters, stiffness, form, out).run(batch.edges);
  } else if (out.gradient != nullptr) {
    Walk<Order::kGradient, kMeasure>(slots, parameters, stiffness, form, out).run(batch.edges);
  } else {
    Walk<Order::kEnergy, kMeasure>(slots, parameters, stiffness, form, out).run(batch.edges);
  }
}

}  // namespace

void evaluate_chains(const ChainBatch& batch, const double* slots, const double* parameters,
                     const RodStiffness& stiffness, BendingForm form, const ChainOutputs& out) {
  if (out.gradient != nullptr) std::fill_n(out.gradient, 3 * kChainLanes, 0.0);
  if (out.band != nullptr) {
    constexpr std::ptrdiff_t kColumn = kBandHeight * kChainLanes;
    const std::ptrdiff_t columns = batch.numbers() + 1;
    const std::ptrdiff_t last = 4 * (batch.edges - 1);
    std::fill_n(out.band, std::min<std::ptrdiff_t>(4, columns) * kColumn, 0.0);
    std::fill(out.band + last * kColumn, out.band + columns * kColumn, 0.0);
  }
  if (measure_of(form) == CurvatureMeasure::kAngle) {
    evaluate_as<CurvatureMeasure::kAngle>(batch, slots, parameters, stiffness, form, out);
  } else {
    evaluate_as<CurvatureMeasure::kTangent>(batch, slots, parameters, stiffness, form, out);
  }
}

}  // namespace limber::rods::detail
