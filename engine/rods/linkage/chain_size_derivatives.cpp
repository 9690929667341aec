#include "engine/rods/linkage/chain_size_derivatives.h"

#include <array>
#include <cstddef>

#include "engine/base/numerics/dual.h"
#include "engine/rods/linkage/chain_lane.h"
#include "engine/rods/rod/vertex_response.h"
#include "engine/rods/solver/lane_transpose.h"

namespace limber::rods::detail {
namespace {

using V = ChainLane;

/// An edge, and how it moves.
struct MovingEdge {
  MaterialFrame<V> frame;
  Vec3<V> spin;  // of its frame
  V longer;      // change of its length
};

/// Twice the factor of LengthWeights in a vertex's energy, and its change.
struct VertexParts {
  V before, after, both, twist;
};

/// Contribution of a vertex at the end of an edge: derivatives by the edge's rest length.
struct VertexShares {
  V by_before = V(0.0), by_after = V(0.0);
};

/// @tparam kMoves  false: v = 0
template <CurvatureMeasure kMeasure, bool kMoves>
class SizeWalk {
 public:
  SizeWalk(const LinkageModel& model, const LinkageState& state, double share, const double* v,
           int batch, const ChainSizeDerivatives& out)
      : model_(model),
        state_(state),
        batch_(model.chains()->batches()[batch]),
        slots_(state.slots(model, batch)),
        parameters_(model.slot_parameters(batch)),
        share_(share),
        v_(v),
        out_(out) {
    for (int lane = 0; lane < kChainLanes; ++lane) {
      const int segment = batch_.chains[lane];
      if (segment >= 0) scale_[lane] = model.section_scales()[segment];
    }
    const V bending = parameter(0, LinkageModel::kBending);
    bending_1_ = model.stiffness().bending_1 * bending;
    bending_2_ = model.stiffness().bending_2 * bending;
    torsion_ = model.stiffness().torsion * bending;
    if constexpr (kMoves) find_changes();
  }

  void run() {
    MovingEdge edge = edge_at(0);
    V rest = parameter(0, LinkageModel::kRestLength);
    VertexShares before;
    for (int e = 0; e < batch_.edges; ++e) {
      const bool last = e + 1 == batch_.edges;
      const MovingEdge next = last ? edge : edge_at(e + 1);
      const V next_rest = last ? rest : parameter(e + 1, LinkageModel::kRestLength);
      const VertexShares after = last ? VertexShares{} : vertex(e, edge, next, rest, next_rest);
      store_lane(out_.rests + e * kChainLanes,
                 stretching(e, edge, rest) + before.by_after + after.by_before);
      before = after;
      edge = next;
      rest = next_rest;
    }
    // Energies go with the second and fourth power of the scale.
    store_lane(out_.section, (2.0 * stretched_ + 4.0 * turned_) / scale_);
  }

 private:
  [[nodiscard]] V parameter(int e, int field) const {
    return load_lane(parameters_ + (e * LinkageModel::kFields + field) * kChainLanes);
  }

  /// Changes of a vertex and of the edge behind it.
  struct VertexChange {
    Vec3<V> vertex;
    V angle = V(0.0);
  };

  void find_changes() {
    for (int lane = 0; lane < kChainLanes; ++lane) {
      // Results of an empty lane are not used.
      const int chain = batch_.chains[batch_.chains[lane] < 0 ? 0 : lane];
      own_[lane] = v_ + model_.chains()->chain_begin(chain) - batch_.begin();
    }
    if (batch_.has_start) start_ = joint_edge(kStart);
    if (batch_.has_finish) finish_ = joint_edge(kFinish);
    here_ = change_at(batch_.has_start ? 1 : 0);
  }

  /// A number of the chains that is no joint's.
  [[nodiscard]] V across(int number) const {
    V result;
    for (int lane = 0; lane < kChainLanes; ++lane) result[lane] = own_[lane][number];
    return result;
  }

  /// Change of a vertex that a joint does not determine alone.
  [[nodiscard]] VertexChange change_at(int i) const {
    const int number = 4 * i;
    if (number >= batch_.begin() && number + 4 <= batch_.end()) {
      Lanes numbers[kChainLanes];
      load_across(own_, number, numbers);
      // By memory: where lanes are wider than the processor's registers, V is no vector of these.
      const double* const values = reinterpret_cast<const double*>(numbers);
      return {load_lanes3(values), load_lane(values + 3 * kChainLanes)};
    }
    VertexChange result;
    if (batch_.has_start && i == 1) {
      result.vertex = beside_[kStart];
    } else if (batch_.has_finish && i + 1 == batch_.edges) {
      result.vertex = beside_[kFinish];
    } else {
      result.vertex = {across(number), across(number + 1), across(number + 2)};
    }
    if (number + 3 < batch_.end()) result.angle = across(number + 3);
    return result;
  }

  [[nodiscard]] MaterialFrame<V> frame_at(int e) const {
    const double* const slot = slots_ + std::ptrdiff_t{e} * LinkageState::kFields * kChainLanes;
    const Vec3<V> difference =
        load_lanes3(slot + LinkageState::kFields * kChainLanes) - load_lanes3(slot);
    const V length = norm(difference);
    const Vec3<V> tangent = (1.0 / length) * difference;
    const Vec3<V> d1 = load_lanes3(slot + LinkageState::kDirector * kChainLanes);
    return {tangent, length, d1, cross(tangent, d1), {}};
  }

  /// From the first edge to the last.
  [[nodiscard]] MovingEdge edge_at(int e) {
    if constexpr (kMoves) {
      if (batch_.has_start && e == 0) return start_;
      if (batch_.has_finish && e + 1 == batch_.edges) return finish_;
    }
    MovingEdge edge{frame_at(e), {}, V(0.0)};
    if constexpr (kMoves) {
      const VertexChange next = change_at(e + 1);
      const Vec3<V> change = next.vertex - here_.vertex;
      const Vec3<V>& tangent = edge.frame.tangent;
      edge.longer = dot(tangent, change);
      edge.spin = (1.0 / edge.frame.length) * cross(tangent, change) + here_.angle * tangent;
      here_ = next;
    }
    return edge;
  }

  /// The change of a joint as its segments' ends see it.
  struct JointMotion {
    Vec3<V> centre, spin;
    V longer;
  };
  [[nodiscard]] JointMotion joint_motion(End end) const {
    alignas(8 * kChainLanes) double cells[7][kChainLanes] = {};
    for (int lane = 0; lane < kChainLanes; ++lane) {
      if (batch_.chains[lane] < 0) continue;
      const Segment& segment = model_.graph().segments[batch_.chains[lane]];
      const double* const own = v_ + model_.chains()->joint_begin(segment.joints[end]);
      const RodOfJoint rod = segment.rods[end];
      const Eigen::Vector3d& normal = state_.joints()[segment.joints[end]].normal;
      const double half = (rod == kRodA ? -0.5 : 0.5) * own[kJointAngle];
      for (int axis = 0; axis < 3; ++axis) {
        cells[axis][lane] = own[kJointPosition + axis];
        cells[3 + axis][lane] = own[kJointRotation + axis] + half * normal[axis];
      }
      cells[6][lane] = own[kJointLengthA + int{rod}];
    }
    return {load_lanes3(cells[0]), load_lanes3(cells[3]), load_lane(cells[6])};
  }
  /// Change of the half of a terminal edge that points along the segment.
  [[nodiscard]] static Vec3<V> half_change(const JointMotion& joint,
                                           const MaterialFrame<V>& frame) {
    return V(0.5) *
           (joint.longer * frame.tangent + frame.length * cross(joint.spin, frame.tangent));
  }
  /// The terminal edge; keeps how the vertex beside it changes.
  [[nodiscard]] MovingEdge joint_edge(End end) {
    const JointMotion joint = joint_motion(end);
    const MovingEdge edge{frame_at(end == kStart ? 0 : batch_.edges - 1), joint.spin, joint.longer};
    const Vec3<V> half = half_change(joint, edge.frame);
    beside_[end] = end == kStart ? joint.centre + half : joint.centre - half;
    return edge;
  }

  /// The vertex after edge e.
  [[nodiscard]] VertexShares vertex(int e, const MovingEdge& edge, const MovingEdge& next,
                                    const V& rest, const V& next_rest) {
    const V twist =
        load_lane(slots_ + ((e + 1) * LinkageState::kFields + LinkageState::kTwist) * kChainLanes);
    const VertexParts parts = vertex_parts(edge.frame, next.frame, twist, next.spin - edge.spin);
    const auto share = [&](double of_before, double of_after) {
      const auto weights = length_weights(Dual<V>(rest, V(of_before)),
                                          Dual<V>(next_rest, V(of_after)), model_.form());
      return 0.5 *
             (weights.before.derivative * parts.before + weights.after.derivative * parts.after +
              2.0 * weights.both.derivative * parts.both + weights.twist.derivative * parts.twist);
    };
    const VertexShares result{share(1, 0), share(0, 1)};
    // The energy goes with one over both lengths (Euler).
    turned_ -= rest * result.by_before + next_rest * result.by_after;
    return result;
  }

  [[nodiscard]] VertexParts vertex_parts(const MaterialFrame<V>& before,
                                         const MaterialFrame<V>& after, const V& twist,
                                         const Vec3<V>& turn) const {
    const auto k = vertex_kinematics(before, after, twist);
    V s(1.0), s_change(0.0);
    const V along_axis = kMoves ? dot(k.axis, turn) : V(0.0);
    if constexpr (kMeasure == CurvatureMeasure::kAngle) {
      const V square = k.inverse * k.inverse * dot(k.axis, k.axis);
      s = turning_ratio<0>(square);
      if constexpr (kMoves)
        s_change = (-2.0 * k.inverse * k.inverse * turning_ratio<1>(square)) * along_axis;
    }
    struct Strain {
      V value, change;
    };
    const auto strain = [&](const V& raw, const Vec3<V>& other, const Vec3<V>& director) {
      if constexpr (!kMoves) return Strain{s * raw, V(0.0)};
      const V slope = k.inverse * (2.0 * dot(cross(other, director), turn) - raw * along_axis);
      return Strain{s * raw, s * slope + s_change * raw};
    };
    const Strain b1 = strain(k.strains.before_1, after.tangent, before.d1);
    const Strain b2 = strain(k.strains.before_2, after.tangent, before.d2);
    const Strain a1 = strain(k.strains.after_1, before.tangent, after.d1);
    const Strain a2 = strain(k.strains.after_2, before.tangent, after.d2);
    const Strain m{twist, k.inverse * dot(before.tangent + after.tangent, turn)};
    const auto part = [&](const Strain& p, const Strain& q) {
      if constexpr (!kMoves) return share_ * p.value * q.value;
      return share_ * p.value * q.value + p.value * q.change + p.change * q.value;
    };
    return {bending_1_ * part(b1, b1) + bending_2_ * part(b2, b2),
            bending_1_ * part(a1, a1) + bending_2_ * part(a2, a2),
            bending_1_ * part(b1, a1) + bending_2_ * part(b2, a2), torsion_ * part(m, m)};
  }

  /// By the edge's own rest length: d/d rest of (l - rest)^2 / (2 rest), and how it changes.
  [[nodiscard]] V stretching(int e, const MovingEdge& edge, const V& rest) {
    const V& length = edge.frame.length;
    const V change = length - rest;
    const V slope = parameter(e, LinkageModel::kStretching) / rest;
    stretched_ += slope * change * (0.5 * share_ * change + edge.longer);
    const V across = length + rest;
    return -(slope / rest) * (0.5 * share_ * change * across + length * edge.longer);
  }

  const LinkageModel& model_;
  const LinkageState& state_;
  const ChainBatch& batch_;
  const double* slots_;
  const double* parameters_;
  const V share_;
  const double* v_;
  const ChainSizeDerivatives& out_;
  V bending_1_, bending_2_, torsion_;
  V scale_ = 1.0;                        // of the section
  const double* own_[kChainLanes] = {};  // of v, by numbers of the chains
  Vec3<V> beside_[2];                    // changes of the vertices next to terminal edges
  MovingEdge start_, finish_;            // terminal edges
  VertexChange here_;                    // before the edge that comes next
  V stretched_ = 0.0, turned_ = 0.0;     // energies as asked
};

template <bool kMoves>
void evaluate(const LinkageModel& model, const LinkageState& state, double share, const double* v,
              int batch, const ChainSizeDerivatives& out) {
  if (measure_of(model.form()) == CurvatureMeasure::kAngle) {
    SizeWalk<CurvatureMeasure::kAngle, kMoves>(model, state, share, v, batch, out).run();
  } else {
    SizeWalk<CurvatureMeasure::kTangent, kMoves>(model, state, share, v, batch, out).run();
  }
}

}  // namespace

void evaluate_chain_sizes(const LinkageModel& model, const LinkageState& state, double share,
                          const double* v, int batch, const ChainSizeDerivatives& out) {
  if (v == nullptr) {
    evaluate<false>(model, state, share, v, batch, out);
  } else {
    evaluate<true>(model, state, share, v, batch, out);
  }
}

}  // namespace limber::rods::detail
