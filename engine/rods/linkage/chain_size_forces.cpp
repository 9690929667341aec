#include "engine/rods/linkage/chain_size_forces.h"

#include <algorithm>

#include "engine/base/numerics/dual.h"
#include "engine/rods/linkage/chain_lane.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/rod/edge_stiffness.h"
#include "engine/rods/rod/stretch_element.h"
#include "engine/rods/rod/vertex_response.h"

namespace limber::rods::detail {
namespace {

using V = ChainLane;

template <CurvatureMeasure kMeasure>
class SizeForceWalk {
 public:
  SizeForceWalk(const double* slots, const double* parameters, const RodStiffness& stiffness,
                BendingForm form, const LaneCell* rests, const double* growth, double* gradient)
      : slots_(slots),
        parameters_(parameters),
        form_(form),
        rests_(rests),
        growth_(load_lane(growth)),
        gradient_(gradient) {
    const V scale = parameter(0, LinkageModel::kBending);
    bending_1_ = stiffness.bending_1 * scale;
    bending_2_ = stiffness.bending_2 * scale;
    torsion_ = stiffness.torsion * scale;
  }

  void run(int edges) {
    std::fill_n(gradient_, 3 * kChainLanes, 0.0);
    MaterialFrame<V> frame = frame_of(0);
    Vec3<V> before{};
    for (int e = 0; e < edges; ++e) {
      const bool last = e + 1 == edges;
      const MaterialFrame<V> next = last ? frame : frame_of(e + 1);
      const Vec3<V> after = last ? Vec3<V>{} : moment(e, frame, next);
      edge(e, frame, before - after);
      before = after;
      frame = next;
    }
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
  [[gnu::always_inline]] Dual<V> rest(int e) const {
    return {parameter(e, LinkageModel::kRestLength), load_lane(rests_[e].values)};
  }

  /// Moments are linear in weights; these go with one over lengths, stiffnesses with the fourth
  /// power of the scale.
  [[gnu::always_inline]] Vec3<V> moment(int e, const MaterialFrame<V>& frame,
                                        const MaterialFrame<V>& next) const {
    const LengthWeights<Dual<V>> weights = length_weights(rest(e), rest(e + 1), form_);
    const auto changed = [&](const Dual<V>& weight) {
      return weight.derivative + 4.0 * growth_ * weight.value;
    };
    const VertexMaterial<V> material{bending_1_,
                                     bending_2_,
                                     torsion_,
                                     {changed(weights.before), changed(weights.after),
                                      changed(weights.both), changed(weights.twist)},
                                     VertexStrains<V>{V(0.0), V(0.0), V(0.0), V(0.0), V(0.0)}};
    const V twist =
        load_lane(slots_ + ((e + 1) * LinkageState::kFields + LinkageState::kTwist) * kChainLanes);
    return vertex_response<VertexOrder::kMoment, kMeasure>(frame, next, twist, material).moment;
  }

  [[gnu::always_inline]] void edge(int e, const MaterialFrame<V>& frame,
                                   const Vec3<V>& moment) const {
    const Dual<V> length = rest(e);
    const auto s = stretch(frame.length, length.value, parameter(e, LinkageModel::kStretching));
    const V tension =
        2.0 * growth_ * s.tension - s.slope * frame.length / length.value * length.derivative;
    const auto gradient = edge_gradient(frame, moment, tension);
    double* const numbers = gradient_ + 4 * e * kChainLanes;
    store_lanes3(numbers, load_lanes3(numbers) - gradient.force);
    store_lane(numbers + 3 * kChainLanes, gradient.torque);
    store_lanes3(numbers + 4 * kChainLanes, gradient.force);
  }

  const double* slots_;
  const double* parameters_;
  BendingForm form_;
  const LaneCell* rests_;
  const V growth_;
  double* gradient_;
  V bending_1_, bending_2_, torsion_;
};

}  // namespace

void evaluate_chain_size_forces(int edges, const double* slots, const double* parameters,
                                const RodStiffness& stiffness, BendingForm form,
                                const LaneCell* rests, const double* growth, double* gradient) {
  if (measure_of(form) == CurvatureMeasure::kAngle) {
    SizeForceWalk<CurvatureMeasure::kAngle>(slots, parameters, stiffness, form, rests, growth,
                                            gradient)
        .run(edges);
  } else {
    SizeForceWalk<CurvatureMeasure::kTangent>(slots, parameters, stiffness, form, rests, growth,
                                              gradient)
        .run(edges);
  }
}

}  // namespace limber::rods::detail
