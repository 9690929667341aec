#include "engine/beams/structure/beam_structure.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/index.h"
#include "engine/base/rotations/shortest_rotation.h"
#include "engine/beams/structure/swing_twist.h"

namespace limber::beams {

namespace {

/// Cosine of half a swing below which it counts as half a turn.
constexpr double kNearHalfTurn = 1e-3;

/// Stiffness of bending in one plane; shear that is released leaves uniform bending only.
void set_plane(double stiffness_per_length, bool slides, double& near, double& far) {
  near = (slides ? 1 : 4) * stiffness_per_length;
  far = (slides ? -1 : 2) * stiffness_per_length;
}

ElementConstants<double> constants_of(const BeamElement& e, const BeamSection& s, double drawn,
                                      Bowing bowing) {
  ElementConstants<double> k;
  k.length = e.rest_length > 0 ? e.rest_length : drawn;
  if (e.kind == BeamKind::kCable) {
    k.stretching = s.stretching / k.length;
    k.least_stretch = 0;
    return k;
  }
  const auto slides = [&e](std::size_t axis) {
    return e.start_release.forces[axis] || e.finish_release.forces[axis];
  };
  k.stretching = slides(0) ? 0 : s.stretching / k.length;
  k.bow = bowing == Bowing::kCounts ? k.length / 30 : 0;
  k.torsion = s.torsion / k.length;
  // Shear along axis 3 goes with bending about axis 2, and vice versa.
  set_plane(s.bending_2 / k.length, slides(2), k.near_2, k.far_2);
  set_plane(s.bending_3 / k.length, slides(1), k.near_3, k.far_3);
  const double twist = e.rest_curvature[0] * k.length;
  k.rest_twist = TwistMeasure<double>(std::sin(twist), std::cos(twist)).value;
  k.rest_angle_2 = 0.5 * e.rest_curvature[1] * k.length;
  k.rest_angle_3 = 0.5 * e.rest_curvature[2] * k.length;
  return k;
}

/// Any axes with the first along the cable: it has no others.
Eigen::Matrix3d cable_frame(const BeamModel& model, const BeamElement& e) {
  const Eigen::Vector3d along =
      model.nodes[index(e.finish)].position - model.nodes[index(e.start)].position;
  return rotations::shortest_rotation(Eigen::Vector3d::UnitX(), along).toRotationMatrix();
}

}  // namespace

Eigen::Quaterniond rotation_by(const Eigen::Vector3d& spin) {
  const double angle = spin.norm();
  // sin(x)/x of the half angle; below 1e-4 the series ends in rounding after two terms.
  const double half = 0.5 * angle;
  const double factor = 0.5 * (half < 1e-4 ? 1 - half * half / 6 : std::sin(half) / half);
  Eigen::Quaterniond q(std::cos(half), factor * spin.x(), factor * spin.y(), factor * spin.z());
  q.normalize();
  return q;
}

BeamStructure::BeamStructure(BeamModel model) : model_(std::move(model)) {
  validate(model_);
  node_axes_.assign(model_.nodes.size(), Eigen::Matrix3d::Identity());
  for (const PrescribedMotion& m : model_.motions) node_axes_[index(m.node)] = m.axes;
  for (const BeamSupport& s : model_.supports) node_axes_[index(s.node)] = s.axes;
  tributary_.assign(model_.nodes.size(), 0);
  released_of_.assign(model_.elements.size(), {-1, -1});
  unknowns_ = 6 * nodes();
  for (int e = 0; e < elements(); ++e) add_element(e);
  hold();
}

void BeamStructure::add_element(int element) {
  const BeamElement& e = model_.elements[index(element)];
  const double drawn = drawn_length(model_, element);
  constants_.push_back(constants_of(e, model_.sections[index(e.section)], drawn, model_.bowing));
  rest_axes_.push_back(e.kind == BeamKind::kBeam ? drawn_frame(model_, element)
                                                 : cable_frame(model_, e));
  add_release(element, ElementEnd::kStart, e.start_release);
  add_release(element, ElementEnd::kFinish, e.finish_release);
  tributary_[index(e.start)] += 0.5 * constants_.back().length;
  tributary_[index(e.finish)] += 0.5 * constants_.back().length;
}

void BeamStructure::add_release(int element, ElementEnd end, const EndRelease& release) {
  const auto axes = std::count(release.rotations.begin(), release.rotations.end(), true);
  if (axes == 0) return;
  const BeamElement& e = model_.elements[index(element)];
  ReleasedEnd r;
  r.element = element;
  r.end = end;
  r.node = end == ElementEnd::kStart ? e.start : e.finish;
  r.axes = static_cast<int>(axes);
  r.rest.setZero();
  for (int k = 0, column = 0; k < 3; ++k) {
    if (release.rotations[index(k)]) r.rest.col(column++) = rest_axes_[index(element)].col(k);
  }
  r.unknown = unknowns_;
  unknowns_ += r.axes;
  released_of_[index(element)][static_cast<std::size_t>(end)] = static_cast<int>(released_.size());
  released_.push_back(r);
}

void BeamStructure::hold() {
  held_.assign(index(unknowns_), 0);
  // Rotations that no beam feels: at cables, and where every beam has a ball joint.
  std::vector<char> turns(model_.nodes.size(), 0);
  for (int e = 0; e < elements(); ++e) {
    const BeamElement& element = model_.elements[index(e)];
    if (element.kind == BeamKind::kCable) continue;
    for (const ElementEnd end : {ElementEnd::kStart, ElementEnd::kFinish}) {
      const int r = released(e, end);
      if (r < 0 || released_[index(r)].axes < 3)
        turns[index(end == ElementEnd::kStart ? element.start : element.finish)] = 1;
    }
  }
  for (int node = 0; node < nodes(); ++node) {
    for (int k = 3; k < 6 && turns[index(node)] == 0; ++k) held_[index(6 * node + k)] = 1;
  }
  // Nodes of no element are left out: they stay where they are drawn, or are brought.
  for (int node = 0; elements() > 0 && node < nodes(); ++node) {
    for (int k = 0; k < 3 && !(tributary_[index(node)] > 0); ++k) held_[index(6 * node + k)] = 1;
  }
  for (const BeamSupport& s : model_.supports) {
    for (int k = 0; k < 6; ++k) {
      if (s.fixed[index(k)]) held_[index(6 * s.node + k)] = 1;
    }
  }
  for (const PrescribedMotion& given : model_.motions) {
    const PrescribedMotion m = motion_by_node_axes(given);
    for (int k = 0; k < 3; ++k) {
      if (m.translates[index(k)]) held_[index(6 * m.node + k)] = 1;
      if (m.rotates[index(k)]) held_[index(6 * m.node + 3 + k)] = 1;
    }
  }
  swings_.assign(model_.nodes.size(), {});
  for (int node = 0; node < nodes(); ++node) {
    const auto first = held_.begin() + 6 * node + 3;
    if (std::count(first, first + 3, 1) == 1)
      swings_[index(node)].axis = static_cast<int>(std::find(first, first + 3, 1) - first);
  }
  for (const PrescribedMotion& given : model_.motions) {
    Swing& swing = swings_[index(given.node)];
    if (swing.axis >= 0) swing.twist = motion_by_node_axes(given).rotation[swing.axis];
  }
}

bool BeamStructure::has_swung_by_half_a_turn(const BeamState& state, int node) const {
  const Swing& held = swing(node);
  if (held.axis < 0) return false;
  const Eigen::Quaterniond by_node =
      quaternion_by_axes(node_axes(node), state.rotations[index(node)]);
  return swing_and_twist(by_node, held.axis, held.twist).swing.w() < kNearHalfTurn;
}

Eigen::Matrix3d BeamStructure::spin_axes(int node, const Eigen::Quaterniond& rotation) const {
  const Eigen::Matrix3d& axes = node_axes(node);
  const Swing& held = swing(node);
  if (held.axis < 0) return axes;
  const SwingTwist parts =
      swing_and_twist(quaternion_by_axes(axes, rotation), held.axis, held.twist);
  return axes * half_of(parts.swing).toRotationMatrix();
}

PrescribedMotion BeamStructure::motion_by_node_axes(const PrescribedMotion& motion) const {
  const auto result = by_axes(motion, node_axes(motion.node));
  LIMBER_DEMAND(result.has_value());  // validated
  return *result;
}

BeamState BeamStructure::rest_state() const {
  BeamState state;
  state.positions.resize(3, nodes());
  for (int i = 0; i < nodes(); ++i) state.positions.col(i) = model_.nodes[index(i)].position;
  state.rotations.assign(index(nodes()), Eigen::Quaterniond::Identity());
  state.hinge_turns.assign(released_.size(), Eigen::Quaterniond::Identity());
  return state;
}

BeamState BeamStructure::moved(const BeamState& state,
                               const Eigen::Ref<const Eigen::VectorXd>& increments) const {
  BeamState result = state;
  for (int i = 0; i < nodes(); ++i) {
    result.positions.col(i) += node_axes(i) * increments.segment<3>(6 * i);
    Eigen::Quaterniond& q = result.rotations[index(i)];
    q = rotation_by(spin_axes(i, q) * increments.segment<3>(6 * i + 3)) * q;
    q.normalize();
  }
  for (std::size_t i = 0; i < released_.size(); ++i) {
    const ReleasedEnd& r = released_[i];
    const Eigen::VectorXd angle = increments.segment(r.unknown, r.axes);
    Eigen::Quaterniond& turn = result.hinge_turns[i];
    if (r.axes == 3) {
      // Spins are about the axes as they have turned.
      const Eigen::Matrix3d axes = turn.toRotationMatrix() * r.rest;
      turn = rotation_by(axes * angle) * turn;
    } else {
      turn = rotation_by(angle[0] * r.rest.col(0)) * turn;
      if (r.axes == 2) turn = turn * rotation_by(angle[1] * r.rest.col(1));
    }
    turn.normalize();
  }
  return result;
}

Eigen::Quaterniond BeamStructure::end_rotation(const BeamState& state, int element,
                                               ElementEnd end) const {
  const BeamElement& e = model_.elements[index(element)];
  const Eigen::Quaterniond& q =
      state.rotations[index(end == ElementEnd::kStart ? e.start : e.finish)];
  const int r = released(element, end);
  return r < 0 ? q : q * state.hinge_turns[index(r)];
}

ElementEnds BeamStructure::ends(const BeamState& state, int element) const {
  const BeamElement& e = model_.elements[index(element)];
  const Eigen::Matrix3d& rest = rest_axes_[index(element)];
  ElementEnds result;
  result.start = state.positions.col(e.start);
  result.finish = state.positions.col(e.finish);
  result.start_axes = end_rotation(state, element, ElementEnd::kStart).toRotationMatrix() * rest;
  result.finish_axes = end_rotation(state, element, ElementEnd::kFinish).toRotationMatrix() * rest;
  return result;
}

Eigen::Matrix3d BeamStructure::turned_axes(const BeamState& state, const ReleasedEnd& r) const {
  const Eigen::Quaterniond& node = state.rotations[index(r.node)];
  const Eigen::Matrix3d beam = end_rotation(state, r.element, r.end).toRotationMatrix();
  Eigen::Matrix3d axes = beam * r.rest;
  if (r.axes < 3) axes.col(0) = node * Eigen::Vector3d(r.rest.col(0));
  return axes;
}

}  // namespace limber::beams
