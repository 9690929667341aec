#include "engine/beams/solver/relaxation_arrays.h"

#include <Eigen/Geometry>

#include "engine/beams/element/element_kernel.h"

namespace limber::beams::detail {

namespace {

/// Stiffness of a slack cable, as a share of its EA / L: enough that cables that hang loose move
/// under their weight by little in a step. Not known to have been tuned.
constexpr double kSlackShare = 1e-4;

namespace stdx = std::experimental;

template <class V>
struct Quaternion {
  V w, x, y, z;
};

template <class V>
[[gnu::always_inline]] inline Quaternion<V> operator*(const Quaternion<V>& a,
                                                      const Quaternion<V>& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

template <class V>
[[gnu::always_inline]] inline Triad<V> axes(const Quaternion<V>& q) {
  const V x = q.x + q.x, y = q.y + q.y, z = q.z + q.z;
  const V xx = x * q.x, xy = x * q.y, xz = x * q.z, yy = y * q.y, yz = y * q.z, zz = z * q.z;
  const V wx = x * q.w, wy = y * q.w, wz = z * q.w;
  return {{1.0 - (yy + zz), xy + wz, xz - wy},
          {xy - wz, 1.0 - (xx + zz), yz + wx},
          {xz + wy, yz - wx, 1.0 - (xx + yy)}};
}

template <class V>
[[gnu::always_inline]] inline V load(const double* from) {
  if constexpr (std::is_same_v<V, double>)
    return *from;
  else
    return V(from, stdx::element_aligned);
}
template <class V>
[[gnu::always_inline]] inline void store(const V& value, double* to) {
  if constexpr (std::is_same_v<V, double>)
    *to = value;
  else
    value.copy_to(to, stdx::element_aligned);
}

/// One number of the slots of an end, for one element or for a batch.
template <class V>
[[gnu::always_inline]] inline V gather(const double* slots, const std::int32_t* which, int member) {
  constexpr int kSize = sizeof(FrameSlot) / sizeof(double);  // numbers of a slot
  if constexpr (std::is_same_v<V, double>)
    return slots[which[0] * kSize + member];
  else
    return V([&](auto lane) { return slots[which[lane] * kSize + member]; });
}

template <class V>
struct EndFrame {
  Vec3<V> position;
  Triad<V> triad;

  [[gnu::always_inline]] inline EndFrame(const double* slots, const std::int32_t* which,
                                         const Quaternion<V>& rest)
      : position{gather<V>(slots, which, 0), gather<V>(slots, which, 1),
                 gather<V>(slots, which, 2)},
        triad(axes(Quaternion<V>{gather<V>(slots, which, 3), gather<V>(slots, which, 4),
                                 gather<V>(slots, which, 5), gather<V>(slots, which, 6)} *
                   rest)) {}
};

template <class V>
[[gnu::always_inline]] inline void store(const Vec3<V>& v, LaneRows& rows, int batch, int c,
                                         int lane) {
  store(v.x, rows.row(batch, c) + lane);
  store(v.y, rows.row(batch, c + 1) + lane);
  store(v.z, rows.row(batch, c + 2) + lane);
}
template <class V>
[[gnu::always_inline]] inline void store(const Sym3<V>& m, LaneRows& rows, int batch, int c) {
  int at = c;
  for (const V& value : {m.xx, m.yx, m.yy, m.zx, m.zy, m.zz}) store(value, rows.row(batch, at++));
}

}  // namespace

/// Element or batch of elements: constants and ends.
template <class V>
struct ElementLoader {
  ElementConstants<V> k;
  Quaternion<V> rest;

  [[gnu::always_inline]] inline ElementLoader(const LaneRows& rows, int batch, int lane) {
    const auto at = [&](int c) { return load<V>(rows.row(batch, c) + lane); };
    using E = RelaxationElements;
    k.length = at(E::kLength);
    k.stretching = at(E::kStretching);
    k.torsion = at(E::kTorsion);
    k.near_2 = at(E::kNear2);
    k.far_2 = at(E::kFar2);
    k.near_3 = at(E::kNear3);
    k.far_3 = at(E::kFar3);
    k.bow = at(E::kBow);
    k.rest_twist = at(E::kRestTwist);
    k.rest_angle_2 = at(E::kRestAngle2);
    k.rest_angle_3 = at(E::kRestAngle3);
    k.least_stretch = at(E::kLeastStretch);
    rest = {at(E::kRestRotation), at(E::kRestRotation + 1), at(E::kRestRotation + 2),
            at(E::kRestRotation + 3)};
  }
};

RelaxationElements::RelaxationElements(const BeamStructure& structure)
    : batches_((structure.elements() + kLanes - 1) / kLanes),
      slots_(structure.nodes() + static_cast<int>(structure.released_ends().size())),
      constants_(kConstantRows, batches_) {
  slot_.resize(static_cast<std::size_t>(2 * batches_ * kLanes));
  for (int i = 0; i < batches_ * kLanes; ++i) {
    // The last batch is filled up with the last element; those results are not used.
    const int e = std::min(i, structure.elements() - 1);
    const ElementConstants<double>& k = structure.constants(e);
    const Eigen::Quaterniond rest(structure.rest_axes(e));
    const double slack =
        structure.model().elements[static_cast<std::size_t>(e)].kind == BeamKind::kCable
            ? kSlackShare * k.stretching
            : 0;
    const double row[kConstantRows] = {
        k.length, k.stretching, k.torsion,    k.near_2,       k.far_2,        k.near_3,
        k.far_3,  k.bow,        k.rest_twist, k.rest_angle_2, k.rest_angle_3, k.least_stretch,
        slack,    rest.w(),     rest.x(),     rest.y(),       rest.z()};
    for (int c = 0; c < kConstantRows; ++c) constants_.at(i, c) = row[c];
    const BeamElement& element = structure.model().elements[static_cast<std::size_t>(e)];
    const auto slot = [&](ElementEnd end, int node) {
      const int r = structure.released(e, end);
      return r < 0 ? node : structure.nodes() + r;
    };
    slot_[place(i, 0)] = slot(ElementEnd::kStart, element.start);
    slot_[place(i, 1)] = slot(ElementEnd::kFinish, element.finish);
  }
}

template <class V>
void RelaxationElements::respond(const FrameSlot* slots, LaneRows& responses) const {
  constexpr int kWidth = std::is_same_v<V, double> ? 1 : kLanes;  // elements of one pass
  const auto* const numbers = reinterpret_cast<const double*>(slots);
  for (int batch = 0; batch < batches_; ++batch) {
    for (int lane = 0; lane < kLanes; lane += kWidth) {
      const ElementLoader<V> element(constants_, batch, lane);
      const std::int32_t* const which = slot_.data() + place(batch * kLanes + lane, 0);
      const EndFrame<V> a(numbers, which, element.rest);
      const EndFrame<V> b(numbers, which + kLanes, element.rest);
      const NaturalModes<V> q(element.k, b.position - a.position, a.triad, b.triad);
      const ElementResponse<V> r(element.k, q, a.triad, b.triad);
      store(r.force, responses, batch, kForce, lane);
      store(r.start_moment, responses, batch, kStartMoment, lane);
      store(r.finish_moment, responses, batch, kFinishMoment, lane);
      store(r.axial, responses.row(batch, kAxial) + lane);
    }
  }
}

template void RelaxationElements::respond<Lanes>(const FrameSlot*, LaneRows&) const;
template void RelaxationElements::respond<double>(const FrameSlot*, LaneRows&) const;

void RelaxationElements::bound(const FrameSlot* slots, LaneRows& bounds) const {
  using V = Lanes;
  using std::sqrt;
  const auto* const numbers = reinterpret_cast<const double*>(slots);
  const auto size = [](const V& v) { return sqrt(v * v); };
  for (int batch = 0; batch < batches_; ++batch) {
    const ElementLoader<V> element(constants_, batch, 0);
    const ElementConstants<V>& k = element.k;
    const std::int32_t* const which = slot_.data() + place(batch * kLanes, 0);
    const EndFrame<V> a(numbers, which, element.rest), b(numbers, which + kLanes, element.rest);
    const NaturalModes<V> q(k, b.position - a.position, a.triad, b.triad);
    const ElementResponse<V> r(k, q, a.triad, b.triad);
    const V inverse = 1.0 / k.length;
    // Bowing turns changes of the end angles into stretch.
    const EndAngles<V>&s = q.start, &f = q.finish;
    const V c1 = 4.0 * s.angle_2 - f.angle_2, c2 = 4.0 * f.angle_2 - s.angle_2;
    const V c3 = 4.0 * s.angle_3 - f.angle_3, c4 = 4.0 * f.angle_3 - s.angle_3;
    const V bowing = k.stretching * k.bow * k.bow * (c1 * c1 + c2 * c2 + c3 * c3 + c4 * c4);
    const V moments = norm(r.start_moment) + norm(r.finish_moment);
    const V pull = size(r.axial);
    const V along = 2.5 * k.stretching;
    const V across_2 = 12.0 * k.near_3 * inverse * inverse,
            across_3 = 12.0 * k.near_2 * inverse * inverse;
    // A chord that turns shows its stretching across the old direction.
    const Vec3<V> before{load<V>(bounds.row(batch, kChord)), load<V>(bounds.row(batch, kChord + 1)),
                         load<V>(bounds.row(batch, kChord + 2))};
    const Vec3<V> turned = cross(q.t, before);
    store(q.t, bounds, batch, kChord, 0);
    const V swing = 4.0 * k.stretching * dot(turned, turned);
    const V across = swing + 40.0 * bowing * inverse * inverse + 2.4 * pull * inverse +
                     2.0 * moments * inverse * inverse;
    const V turning = 10.0 * bowing + moments + pull * k.bow;
    const Triad<V>&x = a.triad, &y = b.triad;
    const Vec3<V> x2 = 0.5 * (x.x2 + y.x2), x3 = 0.5 * (x.x3 + y.x3);
    // Half of each direction's bound goes to all directions: axes of ends and chord differ.
    const V slack = load<V>(constants_.row(batch, kSlack));
    const V spread_t = 0.1 * (across_2 + across_3) + across + slack;
    const V spread_r = 0.3 * (k.near_2 + k.near_3) + turning;
    const Sym3<V> translation = along * square(q.t) + across_2 * square(x2) +
                                across_3 * square(x3) + scaled_identity(spread_t);
    const Sym3<V> rotation = 2.0 * k.torsion * square(q.t) + (3.0 * k.near_2) * square(x2) +
                             (3.0 * k.near_3) * square(x3) + scaled_identity(spread_r);
    store(translation, bounds, batch, kTranslation);
    store(rotation, bounds, batch, kRotation);
  }
}

}  // namespace limber::beams::detail
