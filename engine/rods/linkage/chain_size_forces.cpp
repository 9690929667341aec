#include "engine/rods/linkage/chain_size_forces.h"

#include <algorithm>

#include "engine/base/numerics/dual.h"
#include "engine/rods/linkage/chain_walk.h"
#include "engine/rods/rod/stretch_element.h"

namespace limber::rods::detail {
namespace {

using V = ChainLane;

template <CurvatureMeasure kMeasure>
class SizeForceWalk {
 public:
  SizeForceWalk(const ChainSlots& chains, const RodStiffness& section, BendingForm form,
                const LaneCell* rests, const double* growth, double* gradient)
      : chains_(chains),
        stiffness_(chains.stiffness(section)),
        form_(form),
        rests_(rests),
        growth_(load_lane(growth)),
        gradient_(gradient) {}

  [[gnu::always_inline]] MaterialFrame<V> edge_at(int e) const { return chains_.frame(e); }

  /// Its moment. Moments are linear in weights; these go with one over lengths, stiffnesses with
  /// the fourth power of the scale.
  [[gnu::always_inline]] Vec3<V> vertex(int e, const MaterialFrame<V>& frame,
                                        const MaterialFrame<V>& next) const {
    const LengthWeights<Dual<V>> weights = length_weights(rest(e), rest(e + 1), form_);
    const auto changed = [&](const Dual<V>& weight) {
      return weight.derivative + 4.0 * growth_ * weight.value;
    };
    const auto material = stiffness_.vertex({changed(weights.before), changed(weights.after),
                                             changed(weights.both), changed(weights.twist)});
    return vertex_response<VertexOrder::kMoment, kMeasure>(frame, next, chains_.twist_after(e),
                                                           material)
        .moment;
  }

  [[gnu::always_inline]] void edge(int e, const MaterialFrame<V>& frame, const MaterialFrame<V>&,
                                   const Vec3<V>& before, const Vec3<V>& after) const {
    const Dual<V> length = rest(e);
    const auto s =
        stretch(frame.length, length.value, chains_.parameter(e, LinkageModel::kStretching));
    const V tension =
        2.0 * growth_ * s.tension - s.slope * frame.length / length.value * length.derivative;
    add_edge_gradient(gradient_, e, edge_gradient(frame, before - after, tension));
  }

 private:
  [[gnu::always_inline]] Dual<V> rest(int e) const {
    return {chains_.rest_length(e), load_lane(rests_[e].values)};
  }

  const ChainSlots chains_;
  const ChainStiffness<V> stiffness_;
  BendingForm form_;
  const LaneCell* rests_;
  const V growth_;
  double* gradient_;
};

}  // namespace

void evaluate_chain_size_forces(int edges, const double* slots, const double* parameters,
                                const RodStiffness& stiffness, BendingForm form,
                                const LaneCell* rests, const double* growth, double* gradient) {
  std::fill_n(gradient, 3 * kChainLanes, 0.0);
  with_measure(form, [&](auto measure) {
    SizeForceWalk<decltype(measure)::value> walk({slots, parameters}, stiffness, form, rests,
                                                 growth, gradient);
    walk_chain(edges, walk);
  });
}

}  // namespace limber::rods::detail
