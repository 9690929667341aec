#include "engine/rods/linkage/chain_derivatives.h"

#include <cstddef>
#include <vector>

#include "engine/base/numerics/dual.h"
#include "engine/rods/linkage/terminal_lanes.h"
#include "engine/rods/rod/edge_stiffness.h"
#include "engine/rods/rod/stretch_element.h"
#include "engine/rods/rod/vertex_response.h"

namespace limber::rods::detail {
namespace {

using V = ChainLane;
using First = Dual<V>;
using Second = Dual<First>;

// A number that moves along both directions, as far as T follows it.
void compose(const V& value, const V&, const V&, V& out) { out = value; }
void compose(const V& value, const V& first, const V&, First& out) { out = {value, first}; }
void compose(const V& value, const V& first, const V& second, Second& out) {
  out = {First(value, first), First(second, V(0.0))};
}

// The highest derivative that T holds; of the second: and a share of that along the second
// direction.
const V& requested_derivative(const V& number, const V&) { return number; }
const V& requested_derivative(const First& number, const V&) { return number.derivative; }
V requested_derivative(const Second& number, const V& share) {
  return number.derivative.derivative + share * number.derivative.value;
}

template <class T>
struct VertexResult {
  Vec3<T> moment;
  T by_rest_before = T(0.0);
  T by_rest_after = T(0.0);
};

template <class T>
class DerivativeWalk {
 public:
  DerivativeWalk(const ChainPoint& point, int batch, const ChainDerivatives& out)
      : point_(point),
        batch_(point.model.chains()->batches()[batch]),
        slots_(point.source.slots(point.model, batch)),
        moved_(point.moved.slots(point.model, batch)),
        parameters_(point.model.slot_parameters(batch)),
        first_slot_(point.model.first_slot(batch)),
        out_(out),
        share_(point.share),
        vertices_(static_cast<std::size_t>(batch_.edges) + 1),
        gradient_(vertices_.size()),
        turns_(vertices_.size(), T(0.0)),
        torques_(vertices_.size(), T(0.0)) {
    std::array<int, kChainLanes> segments;
    for (int lane = 0; lane < kChainLanes; ++lane) {
      segments[lane] = batch_.chains[lane];
      if (segments[lane] >= 0) scale_[lane] = point.model.section_scales()[segments[lane]];
    }
    const auto direction = [&](int k) { return gather(point.sections[k], segments) / scale_; };
    compose(V(1.0), direction(0), direction(1), growth_);
    square_ = growth_ * growth_;
    const V square = scale_ * scale_;
    const T inertia = square * square * (square_ * square_);
    const RodStiffness& stiffness = point.model.stiffness();
    bending_1_ = stiffness.bending_1 * inertia;
    bending_2_ = stiffness.bending_2 * inertia;
    torsion_ = stiffness.torsion * inertia;
  }

  void run() {
    place();
    MaterialFrame<T> frame = frame_of(0);
    VertexResult<T> before{};
    for (int e = 0; e < batch_.edges; ++e) {
      const bool last = e + 1 == batch_.edges;
      const MaterialFrame<T> next = last ? frame : frame_of(e + 1);
      const VertexResult<T> after = last ? VertexResult<T>{} : vertex(e, frame, next);
      edge(e, frame, before, after);
      before = after;
      frame = next;
    }
    write();
  }

 private:
  /// A number for each lane, given where it finds it; -1 or no list: zero.
  static V gather(const double* from, const std::array<int, kChainLanes>& index) {
    V result(0.0);
    if (from == nullptr) return result;
    for (int lane = 0; lane < kChainLanes; ++lane)
      if (index[lane] >= 0) result[lane] = from[index[lane]];
    return result;
  }
  /// One number of each lane along the directions.
  T moving(const V& value, const std::array<int, kChainLanes>& index) const {
    T result;
    compose(value + gather(point_.increment, index), gather(point_.directions[0], index),
            gather(point_.directions[1], index), result);
    return result;
  }
  [[nodiscard]] std::array<int, kChainLanes> chain_unknown(int number) const {
    std::array<int, kChainLanes> index;
    for (int lane = 0; lane < kChainLanes; ++lane) {
      const int chain = batch_.chains[lane];
      index[lane] =
          chain < 0 ? -1 : point_.model.chains()->chain_begin(chain) + number - batch_.begin();
    }
    return index;
  }

  /// Vertices and angles from the source and their increments.
  void place() {
    for (int number = batch_.begin(); number < batch_.end(); ++number) {
      const int slot = number / 4, axis = number % 4;
      if (axis == 3) {
        turns_[slot] = moving(V(0.0), chain_unknown(number));
        continue;
      }
      const V from = load_lane(slots_ + (slot * LinkageState::kFields + axis) * kChainLanes);
      const T at = moving(from, chain_unknown(number));
      (axis == 0 ? vertices_[slot].x : axis == 1 ? vertices_[slot].y : vertices_[slot].z) = at;
    }
    if (batch_.has_start) place_end(kStart);
    if (batch_.has_finish) place_end(kFinish);
  }

  void place_end(End end) {
    joints_[end] = joint_at(end);
    changes_[end] = change_at(end);
    terminals_[end] = terminal_lanes(joints_[end], changes_[end]);
    const int edge = end == kStart ? 0 : batch_.edges - 1;
    vertices_[edge] = terminals_[end].first;
    vertices_[edge + 1] = terminals_[end].second;
  }

  [[nodiscard]] JointLanes joint_at(End end) const {
    // An empty lane keeps the straight rod that states put there.
    const double middle = end == kStart ? 0.5 : batch_.edges - 0.5;
    JointLanes lanes{{V(middle), V(0.0), V(0.0)},
                     {V(0.0), V(0.0), V(1.0)},
                     {V(1.0), V(0.0), V(0.0)},
                     V(0.0),
                     V(1.0),
                     V(-0.5),
                     V(1.0)};
    for (int lane = 0; lane < kChainLanes; ++lane) {
      if (batch_.chains[lane] < 0) continue;
      const Segment& segment = point_.model.graph().segments[batch_.chains[lane]];
      const JointState<double>& joint = point_.source.joints()[segment.joints[end]];
      const auto set = [&](Vec3<V>& to, const Eigen::Vector3d& from) {
        to.x[lane] = from.x();
        to.y[lane] = from.y();
        to.z[lane] = from.z();
      };
      set(lanes.position, joint.position);
      set(lanes.normal, joint.normal);
      set(lanes.bisector, joint.bisector);
      lanes.angle[lane] = joint.opening_angle;
      lanes.length[lane] = joint.lengths[segment.rods[end]];
      lanes.half[lane] = segment.rods[end] == kRodA ? -0.5 : 0.5;
      lanes.sign[lane] = segment.signs[end];
    }
    return lanes;
  }

  /// Index of an unknown of the joints at an end; `own_length`: that of each lane's rod.
  [[nodiscard]] std::array<int, kChainLanes> joint_unknown(End end, int unknown) const {
    std::array<int, kChainLanes> index;
    for (int lane = 0; lane < kChainLanes; ++lane) {
      index[lane] = -1;
      if (batch_.chains[lane] < 0) continue;
      const Segment& segment = point_.model.graph().segments[batch_.chains[lane]];
      const int rod = unknown == kJointLengthA ? int(segment.rods[end]) : 0;
      index[lane] = point_.model.chains()->joint_begin(segment.joints[end]) + unknown + rod;
    }
    return index;
  }
  [[nodiscard]] JointChange<T> change_at(End end) const {
    const auto at = [&](int unknown) { return moving(V(0.0), joint_unknown(end, unknown)); };
    return {{at(0), at(1), at(2)}, {at(3), at(4), at(5)}, at(kJointAngle), at(kJointLengthA)};
  }

  [[nodiscard]] MaterialFrame<T> frame_of(int e) const {
    const bool at_start = batch_.has_start && e == 0;
    if (at_start || (batch_.has_finish && e == batch_.edges - 1)) {
      const TerminalLanes<T>& edge = terminals_[at_start ? kStart : kFinish];
      return {edge.tangent, edge.length, edge.director, edge.normal, {}};
    }
    const double* const slot = slots_ + std::ptrdiff_t{e} * LinkageState::kFields * kChainLanes;
    const Vec3<V> source =
        load_lanes3(slot + LinkageState::kFields * kChainLanes) - load_lanes3(slot);
    const V inverse = 1.0 / norm(source);
    return material_frame(vertices_[e], vertices_[e + 1], turns_[e], constant<T>(inverse * source),
                          constant<T>(load_lanes3(slot + LinkageState::kDirector * kChainLanes)));
  }

  [[nodiscard]] T rest(int e) const {
    const auto direction = [&](int k) {
      const LaneCell* const cells = point_.rests[k];
      return cells == nullptr ? V(0.0) : load_lane(cells[first_slot_ + e].values);
    };
    T result;
    compose(parameter(e, LinkageModel::kRestLength), direction(0), direction(1), result);
    return result;
  }
  [[nodiscard]] V parameter(int e, int field) const {
    return load_lane(parameters_ + (e * LinkageModel::kFields + field) * kChainLanes);
  }

  /// The vertex after edge e.
  [[nodiscard]] VertexResult<T> vertex(int e, const MaterialFrame<T>& frame,
                                       const MaterialFrame<T>& next) {
    const BendingForm form = point_.model.form();
    const T before = rest(e), after = rest(e + 1);
    const VertexStrains<T> none{T(0.0), T(0.0), T(0.0), T(0.0), T(0.0)};
    VertexMaterial<T> material{bending_1_, bending_2_, torsion_,
                               length_weights(before, after, form), none};
    const V branch =
        load_lane(moved_ + ((e + 1) * LinkageState::kFields + LinkageState::kTwist) * kChainLanes);
    const auto response = vertex_response<VertexOrder::kMoment>(
        frame, next, material_twist(frame, next, T(branch)), material, form);
    VertexResult<T> result;
    result.moment = response.moment;
    // Rest lengths only enter the weights, linearly.
    const auto by_rest = [&](const T& first, const T& second) {
      const auto weights = length_weights(Dual<T>(before, first), Dual<T>(after, second), form);
      material.weights = {weights.before.derivative, weights.after.derivative,
                          weights.both.derivative, weights.twist.derivative};
      const auto& strains = response.strains;
      const auto energy = vertex_energy(strains, vertex_stresses(strains, material), none);
      return energy.bending + energy.twisting;
    };
    result.by_rest_before = by_rest(T(1.0), T(0.0));
    result.by_rest_after = by_rest(T(0.0), T(1.0));
    // The energy goes with one over both lengths (Euler).
    turning_ -= before * result.by_rest_before + after * result.by_rest_after;
    return result;
  }

  void edge(int e, const MaterialFrame<T>& frame, const VertexResult<T>& before,
            const VertexResult<T>& after) {
    const T length = rest(e);
    const auto s = stretch(frame.length, length, parameter(e, LinkageModel::kStretching) * square_);
    stretching_ += s.energy;
    const auto gradient = edge_gradient(frame, before.moment - after.moment, s.tension);
    gradient_[e] -= gradient.force;
    gradient_[e + 1] += gradient.force;
    torques_[e] = gradient.torque;
    // d/d rest of (l - rest)^2 / (2 rest).
    const T by_rest = T(-0.5) * s.tension * (frame.length + length) / length +
                      before.by_rest_after + after.by_rest_before;
    store_lane(out_.rests + e * kChainLanes, requested_derivative(by_rest, share_));
  }

  void write() const {
    for (int number = batch_.begin(); number < batch_.end(); ++number) {
      const int slot = number / 4, axis = number % 4;
      const T& value = axis == 0   ? gradient_[slot].x
                       : axis == 1 ? gradient_[slot].y
                       : axis == 2 ? gradient_[slot].z
                                   : torques_[slot];
      store_lane(out_.numbers + number * kChainLanes, requested_derivative(value, share_));
    }
    // Energies go with the second and fourth power of the scale.
    const T by_scale = (2.0 * stretching_ + 4.0 * turning_) / (scale_ * growth_);
    store_lane(out_.section, requested_derivative(by_scale, share_));
    if (batch_.has_start) write_end(kStart);
    if (batch_.has_finish) write_end(kFinish);
  }
  void write_end(End end) const {
    const int edge = end == kStart ? 0 : batch_.edges - 1;
    const JointChange<T> by =
        terminal_gradient(joints_[end], changes_[end], terminals_[end], gradient_[edge],
                          torques_[edge], gradient_[edge + 1]);
    double* const out = out_.joints + std::ptrdiff_t{end} * kJointUnknowns * kChainLanes;
    const T* const parts[] = {&by.position.x, &by.position.y, &by.position.z, &by.rotation.x,
                              &by.rotation.y, &by.rotation.z, &by.angle,      &by.length};
    for (int k = 0; k < kJointLengthA; ++k)
      store_lane(out + k * kChainLanes, requested_derivative(*parts[k], share_));
    const V length = requested_derivative(by.length, share_), on_b = joints_[end].half + 0.5;
    store_lane(out + kJointLengthA * kChainLanes, (1.0 - on_b) * length);
    store_lane(out + kJointLengthB * kChainLanes, on_b * length);
  }

  const ChainPoint& point_;
  const ChainBatch& batch_;
  const double* slots_;
  const double* moved_;
  const double* parameters_;
  std::size_t first_slot_;
  const ChainDerivatives& out_;
  const V share_;
  std::vector<Vec3<T>> vertices_, gradient_;
  std::vector<T> turns_, torques_;
  JointLanes joints_[2];
  JointChange<T> changes_[2];
  TerminalLanes<T> terminals_[2];
  T bending_1_, bending_2_, torsion_;
  V scale_ = 1.0;                             // of the section
  T growth_;                                  // over that, 1 with its directions
  T square_;                                  // of it
  T stretching_ = T(0.0), turning_ = T(0.0);  // energies
};

}  // namespace

void evaluate_chain_derivatives(const ChainPoint& point, int batch, int order,
                                const ChainDerivatives& out) {
  if (order == 0) DerivativeWalk<V>(point, batch, out).run();
  if (order == 1) DerivativeWalk<First>(point, batch, out).run();
  if (order == 2) DerivativeWalk<Second>(point, batch, out).run();
}

}  // namespace limber::rods::detail
