#include "engine/rods/linkage/chain_energy.h"

#include <algorithm>

#include "engine/rods/linkage/chain_walk.h"
#include "engine/rods/rod/stretch_element.h"

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
/// in order, each before its vertex with the next: what nothing has been added to is set, so that
/// only the columns of the first edge and those behind the last one need to be zero before.
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

  /// Of an edge with the next, numbers 0 to 10.
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

template <Order kOrder, CurvatureMeasure kMeasure>
class EnergyWalk {
 public:
  EnergyWalk(int edges, const ChainSlots& chains, const RodStiffness& section, BendingForm form,
             const ChainOutputs& out)
      : edges_(edges),
        chains_(chains),
        stiffness_(chains.stiffness(section)),
        form_(form),
        out_(out) {}

  void run() {
    walk_chain(edges_, *this);
    store_lane(out_.energies, stretching_);
    store_lane(out_.energies + kChainLanes, bending_);
    store_lane(out_.energies + 2 * kChainLanes, twisting_);
  }

  [[gnu::always_inline]] MaterialFrame<V> edge_at(int e) const { return chains_.frame(e); }

  [[gnu::always_inline]] VertexResult vertex(int e, const MaterialFrame<V>& frame,
                                             const MaterialFrame<V>& next) {
    constexpr VertexOrder kVertexOrder = kOrder == Order::kEnergy     ? VertexOrder::kEnergy
                                         : kOrder == Order::kGradient ? VertexOrder::kMoment
                                                                      : VertexOrder::kStiffness;
    const auto weights = length_weights(chains_.rest_length(e), chains_.rest_length(e + 1), form_);
    const auto response = vertex_response<kVertexOrder, kMeasure>(
        frame, next, chains_.twist_after(e), stiffness_.vertex(weights));
    bending_ += response.energy.bending;
    twisting_ += response.energy.twisting;
    return {response.moment, response.stiffness};
  }

  [[gnu::always_inline]] void edge(int e, const MaterialFrame<V>& frame,
                                   const MaterialFrame<V>& next, const VertexResult& before,
                                   const VertexResult& after) {
    auto s = stretch(frame.length, chains_.rest_length(e),
                     chains_.parameter(e, LinkageModel::kStretching));
    stretching_ += s.energy;
    if constexpr (kOrder == Order::kHessian) {
      if (out_.tensions != nullptr) s.tension = load_lane(out_.tensions + e * kChainLanes);
    }
    if constexpr (kOrder != Order::kEnergy) {
      const Vec3<V> moment = before.moment - after.moment;
      add_edge_gradient(out_.gradient, e, edge_gradient(frame, moment, s.tension));
      if constexpr (kOrder == Order::kHessian) {
        EdgeBlock<V> block = edge_block(frame, moment, before.stiffness + after.stiffness);
        auto stiff = s;
        if (out_.compression == Compression::kLeftOut) stiff.tension = max(s.tension, V(0.0));
        block.ee += stretch_stiffness(stiff, frame.tangent, frame.length);
        const BandWriter band(out_.band, 4 * e);
        band.add_edge(block);
        if (e + 1 < edges_) band.add_cross(cross_block(frame, next, after.moment, after.stiffness));
      }
    }
  }

 private:
  const int edges_;
  const ChainSlots chains_;
  const ChainStiffness<V> stiffness_;
  BendingForm form_;
  const ChainOutputs& out_;
  V stretching_ = 0.0, bending_ = 0.0, twisting_ = 0.0;
};

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
  const ChainSlots chains{slots, parameters};
  with_measure(form, [&](auto measure) {
    constexpr CurvatureMeasure kMeasure = decltype(measure)::value;
    if (out.band != nullptr) {
      EnergyWalk<Order::kHessian, kMeasure>(batch.edges, chains, stiffness, form, out).run();
    } else if (out.gradient != nullptr) {
      EnergyWalk<Order::kGradient, kMeasure>(batch.edges, chains, stiffness, form, out).run();
    } else {
      EnergyWalk<Order::kEnergy, kMeasure>(batch.edges, chains, stiffness, form, out).run();
    }
  });
}

}  // namespace limber::rods::detail
