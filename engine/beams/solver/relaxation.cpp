#include "engine/beams/solver/relaxation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "engine/base/index.h"

namespace limber::beams::detail {

namespace {

constexpr int kStepsOfMasses = 10;          // until they are computed anew
constexpr double kMassFactor = 0.3;         // of the bounds; above 1/4 by the change in a few steps
constexpr double kLargestTurnOfStep = 0.2;  // of a step [rad]

[[gnu::always_inline]] inline void multiply(const double m[6], const double v[3], double out[3]) {
  out[0] = m[0] * v[0] + m[1] * v[1] + m[3] * v[2];
  out[1] = m[1] * v[0] + m[2] * v[1] + m[4] * v[2];
  out[2] = m[3] * v[0] + m[4] * v[1] + m[5] * v[2];
}

Eigen::Matrix3d symmetric(const double m[6]) {
  Eigen::Matrix3d result;
  result << m[0], m[1], m[3], m[1], m[2], m[4], m[3], m[4], m[5];
  return result;
}

/// Lower triangle by rows.
void write(const Eigen::Matrix3d& m, double out[6]) {
  const double entries[6] = {m(0, 0), m(1, 0), m(1, 1), m(2, 0), m(2, 1), m(2, 2)};
  std::copy(entries, entries + 6, out);
}

[[gnu::always_inline]] inline void project(const double m[6], double v[3]) {
  const double before[3] = {v[0], v[1], v[2]};
  multiply(m, before, v);
}

/// Inverse of a mass on the span of the columns of `free`; held directions stay.
void invert(Eigen::Matrix3d mass, const Eigen::Matrix3d& free, double out[6]) {
  if (!(mass.trace() > 0)) {
    std::fill(out, out + 6, 0.0);  // nothing acts on it either
    return;
  }
  // Directions without stiffness (a slack cable's) get a little: they move, but not at once.
  mass.diagonal().array() += 1e-6 * mass.trace();
  const Eigen::Matrix3d held = Eigen::Matrix3d::Identity() - free;
  // P M P / s + (I - P) is block diagonal: its inverse less (I - P) is that on the free ones.
  const double s = mass.trace();
  write((free * mass * free + s * held).inverse() - held / s, out);
}

/// q <- exp(spin / 2) q to second order, of unit norm.
[[gnu::always_inline]] inline void turn(const double w[3], double q[4]) {
  const double x = 0.5 * w[0], y = 0.5 * w[1], z = 0.5 * w[2];
  const double a = q[0] - x * q[1] - y * q[2] - z * q[3];
  const double b = q[1] + x * q[0] + y * q[3] - z * q[2];
  const double c = q[2] + y * q[0] + z * q[1] - x * q[3];
  const double d = q[3] + z * q[0] + x * q[2] - y * q[1];
  const double scale = 1 / std::sqrt(a * a + b * b + c * c + d * d);
  q[0] = a * scale;
  q[1] = b * scale;
  q[2] = c * scale;
  q[3] = d * scale;
}

Eigen::Quaterniond quaternion(const double q[4]) { return {q[0], q[1], q[2], q[3]}; }

}  // namespace

Relaxation::Relaxation(const BeamStructure& structure, const BeamState& start, ElementKernel kernel)
    : structure_(structure),
      kernel_(kernel),
      elements_(structure),
      responses_(kResponseRows, elements_.batches()),
      bounds_(kAllBoundRows, elements_.batches()),
      slots_(index(elements_.slots())),
      rows_(index(structure.nodes())),
      used_(used_nodes(structure.model())) {
  for (int i = 0; i < structure.nodes(); ++i) {
    Row& row = rows_[index(i)];
    row = Row{};
    Eigen::Map<Eigen::Vector3d>(row.position) = start.positions.col(i);
    const Eigen::Quaterniond& q = start.rotations[index(i)];
    row.rotation[0] = q.w();
    Eigen::Map<Eigen::Vector3d>(row.rotation + 1) = q.vec();
    row.held = -1;
    const auto first = structure.held().begin() + 6 * i;
    if (std::all_of(first, first + 6, [](auto held) { return held == 0; })) continue;
    row.held = static_cast<int>(held_.size());
    if (structure.swing(i).axis >= 0) swings_.push_back(i);
    Held& held = held_.emplace_back();
    write(free_directions(i, 0), held.translation);
    write(free_directions(i, 3), held.rotation);
  }
  for (int i = 0; i < static_cast<int>(structure.released_ends().size()); ++i) {
    Hinge hinge;
    hinge.end = i;
    hinge.turn = start.hinge_turns[index(i)];
    hinges_.push_back(hinge);
  }
  std::vector<std::vector<Place>> places(rows_.size());
  for (int e = 0; e < structure.elements(); ++e) {
    const BeamElement& element = structure.model().elements[index(e)];
    for (const int node : {element.start, element.finish}) {
      double& reach = rows_[index(node)].reach;
      reach = std::max(reach, std::pow(structure.constants(e).length, -2));
    }
    const int force = responses_.index(e, kForce);
    const Place start_place{force, responses_.index(e, kStartMoment), 1};
    const Place finish_place{force, responses_.index(e, kFinishMoment), -1};
    places[index(element.start)].push_back(start_place);
    places[index(element.finish)].push_back(finish_place);
    if (const int r = structure.released(e, ElementEnd::kStart); r >= 0)
      hinges_[index(r)].place = start_place;
    if (const int r = structure.released(e, ElementEnd::kFinish); r >= 0)
      hinges_[index(r)].place = finish_place;
  }
  for (const auto& of_node : places) {
    first_place_.push_back(static_cast<int>(places_.size()));
    places_.insert(places_.end(), of_node.begin(), of_node.end());
  }
  first_place_.push_back(static_cast<int>(places_.size()));
  write_slots();
  gather_masses();
}

void Relaxation::set_loads(const NodeLoads& loads) {
  loads_ = loads;
  loads_follow_ = !loads.following_forces.isZero(0) || !loads.following_moments.isZero(0);
  loaded_.clear();
  for (int e = 0; e < structure_.elements(); ++e) {
    if (!loads.element_forces.col(e).isZero(0) || !loads.following_element_forces.col(e).isZero(0))
      loaded_.push_back({e, load_transfer(structure_, e)});
  }
  for (int i = 0; i < structure_.nodes(); ++i) {
    Eigen::Map<Eigen::Vector3d>(rows_[index(i)].force) = loads.forces.col(i);
    Eigen::Map<Eigen::Vector3d>(rows_[index(i)].moment) = loads.moments.col(i);
  }
}

void Relaxation::turn_loads() {
  for (int i = 0; i < structure_.nodes(); ++i) {
    Row& row = rows_[index(i)];
    const Eigen::Matrix3d turned = quaternion(row.rotation).toRotationMatrix();
    Eigen::Map<Eigen::Vector3d>(row.force) =
        loads_.forces.col(i) + turned * loads_.following_forces.col(i);
    Eigen::Map<Eigen::Vector3d>(row.moment) =
        loads_.moments.col(i) + turned * loads_.following_moments.col(i);
  }
}

/// Loads over elements: forces on nodes, after the loads of these, and moments on ends, off those
/// of the elements.
void Relaxation::spread_loads() {
  if (!loads_follow_) {
    for (int i = 0; i < structure_.nodes(); ++i) {
      Eigen::Map<Eigen::Vector3d>(rows_[index(i)].force) = loads_.forces.col(i);
    }
  }
  for (const Loaded& loaded : loaded_) {
    const int e = loaded.element;
    const BeamElement& element = structure_.model().elements[index(e)];
    const ElementEnds ends = slot_ends(e);
    const ElementVector forces =
        spread_forces(loaded.transfer, ends, load_over(structure_, loads_, ends, e));
    Eigen::Map<Eigen::Vector3d>(rows_[index(element.start)].force) += forces.segment<3>(0);
    Eigen::Map<Eigen::Vector3d>(rows_[index(element.finish)].force) += forces.segment<3>(6);
    for (int c = 0; c < 3; ++c) {
      responses_.at(e, kStartMoment + c) -= forces[3 + c];
      responses_.at(e, kFinishMoment + c) -= forces[9 + c];
    }
  }
}

ElementEnds Relaxation::slot_ends(int element) const {
  const FrameSlot& start = slots_[index(elements_.start_slot(element))];
  const FrameSlot& finish = slots_[index(elements_.finish_slot(element))];
  const Eigen::Matrix3d& rest = structure_.rest_axes(element);
  ElementEnds ends;
  ends.start = Eigen::Map<const Eigen::Vector3d>(start.position);
  ends.finish = Eigen::Map<const Eigen::Vector3d>(finish.position);
  ends.start_axes = quaternion(start.rotation).toRotationMatrix() * rest;
  ends.finish_axes = quaternion(finish.rotation).toRotationMatrix() * rest;
  return ends;
}

Eigen::Matrix3d Relaxation::free_directions(int node, int first) const {
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d axes = first < 3 ? structure_.node_axes(node) : spin_axes(node);
  for (int k = 0; k < 3; ++k) {
    if (structure_.held()[index(6 * node + first + k)] == 0)
      result += axes.col(k) * axes.col(k).transpose();
  }
  return result;
}

Eigen::Matrix3d Relaxation::spin_axes(int node) const {
  return structure_.spin_axes(node, quaternion(rows_[index(node)].rotation));
}

/// The directions in which these nodes may spin turn with them.
void Relaxation::follow_swings() {
  for (const int node : swings_) {
    Row& row = rows_[index(node)];
    write(free_directions(node, 3), held_[index(row.held)].rotation);
    project(held_[index(row.held)].rotation, row.spin);
  }
}

void Relaxation::gather_masses() {
  elements_.bound(slots_.data(), bounds_);
  steps_since_masses_ = 0;
  std::vector<Eigen::Matrix3d> translation(rows_.size(), Eigen::Matrix3d::Zero());
  std::vector<Eigen::Matrix3d> rotation = translation;
  for (int e = 0; e < structure_.elements(); ++e) {
    double t[6], r[6];
    for (int c = 0; c < 6; ++c) {
      t[c] = kMassFactor * bounds_.at(e, kTranslation + c);
      r[c] = kMassFactor * bounds_.at(e, kRotation + c);
    }
    const BeamElement& element = structure_.model().elements[index(e)];
    for (const ElementEnd end : {ElementEnd::kStart, ElementEnd::kFinish}) {
      const int node = end == ElementEnd::kStart ? element.start : element.finish;
      translation[index(node)] += symmetric(t);
      const int released = structure_.released(e, end);
      // The end turns by the sum of node and hinge: each may take half.
      rotation[index(node)] += (released < 0 ? 1 : 2) * symmetric(r);
      if (released < 0) continue;
      Hinge& hinge = hinges_[index(released)];
      const ReleasedEnd& of = structure_.released_ends()[index(released)];
      const Eigen::Matrix3d axes = hinge_axes(hinge);
      for (int k = 0; k < of.axes; ++k)
        hinge.mobility[k] =
            1 / (2 * of.axes * axes.col(k).dot(symmetric(r) * axes.col(k)) + 1e-300);
    }
  }
  for (int i = 0; i < structure_.nodes(); ++i) {
    invert(translation[index(i)], free_directions(i, 0), rows_[index(i)].mobility_t);
    invert(rotation[index(i)], free_directions(i, 3), rows_[index(i)].mobility_r);
  }
}

void Relaxation::respond() {
  if (kernel_ == ElementKernel::kVector)
    elements_.respond<Lanes>(slots_.data(), responses_);
  else
    elements_.respond<double>(slots_.data(), responses_);
}

Eigen::Matrix3d Relaxation::hinge_axes(const Hinge& hinge) const {
  const ReleasedEnd& of = structure_.released_ends()[index(hinge.end)];
  const Eigen::Matrix3d node = quaternion(rows_[index(of.node)].rotation).toRotationMatrix();
  Eigen::Matrix3d axes = node * hinge.turn.toRotationMatrix() * of.rest;
  if (of.axes < 3) axes.col(0) = node * of.rest.col(0);
  return axes;
}

void Relaxation::accelerate_hinges() {
  const double* const from = responses_.data();
  for (Hinge& hinge : hinges_) {
    const Eigen::Matrix3d axes = hinge_axes(hinge);
    const int at = hinge.place.moment;
    const Eigen::Vector3d moment(-from[at], -from[at + kLanes], -from[at + 2 * kLanes]);
    for (int k = 0; k < structure_.released_ends()[index(hinge.end)].axes; ++k) {
      hinge.moment[k] = axes.col(k).dot(moment);
      hinge.acceleration[k] = hinge.mobility[k] * hinge.moment[k];
      power_ += hinge.moment[k] * (hinge.velocity[k] + 0.5 * hinge.acceleration[k]);
    }
  }
}

void Relaxation::out_of_balance(int node, double force[3], double moment[3]) const {
  const double* const from = responses_.data();
  const Row& row = rows_[index(node)];
  for (int c = 0; c < 3; ++c) {
    force[c] = row.force[c];
    moment[c] = row.moment[c];
  }
  for (int p = first_place_[index(node)]; p < first_place_[index(node) + 1]; ++p) {
    const Place& place = places_[index(p)];
    for (int c = 0; c < 3; ++c) {
      force[c] += place.sign * from[place.force + c * kLanes];
      moment[c] -= from[place.moment + c * kLanes];
    }
  }
}

void Relaxation::accelerate() {
  power_ = 0;
  if (!hinges_.empty()) accelerate_hinges();
  for (int i = 0; i < structure_.nodes(); ++i) {
    Row& row = rows_[index(i)];
    double force[3], moment[3];
    out_of_balance(i, force, moment);
    // Rounding of mobilities lets held nodes creep. The forces that hold them would do work, and
    // hide from the sum of powers when it passes zero.
    if (row.held >= 0) {
      project(held_[index(row.held)].translation, force);
      project(held_[index(row.held)].rotation, moment);
    }
    multiply(row.mobility_t, force, row.acceleration);
    multiply(row.mobility_r, moment, row.angular);
    for (int c = 0; c < 3; ++c) {
      power_ += force[c] * (row.velocity[c] + 0.5 * row.acceleration[c]) +
                moment[c] * (row.spin[c] + 0.5 * row.angular[c]);
    }
  }
  // Masses are those of some steps ago.
  for (const int node : swings_) {
    Row& row = rows_[index(node)];
    project(held_[index(row.held)].rotation, row.angular);
  }
}

void Relaxation::step() {
  if (steps_since_masses_++ >= kStepsOfMasses) gather_masses();
  if (loads_follow_) turn_loads();
  respond();
  if (!loaded_.empty()) spread_loads();
  follow_swings();
  accelerate();
  kinetic_energy_ += power_;
  finite_ = std::isfinite(kinetic_energy_);
  // Past a maximum of the energy everything stops, and starts anew by half a step.
  const bool past = power_ < 0;
  if (past) {
    ++peaks_;
    kinetic_energy_ = 0;
    if (steps_since_masses_ > 5) gather_masses();
  }
  const double keep = past ? 0 : 1, gain = past ? 0.5 : 1;
  double fastest = 0;
  for (Row& row : rows_) {
    double squared = 0, moved = 0;
    for (int c = 0; c < 3; ++c) {
      row.velocity[c] = keep * row.velocity[c] + gain * row.acceleration[c];
      row.spin[c] = keep * row.spin[c] + gain * row.angular[c];
      squared += row.spin[c] * row.spin[c];
      moved += row.velocity[c] * row.velocity[c];
    }
    fastest = std::max({fastest, squared, moved * row.reach});
  }
  for (Hinge& hinge : hinges_) {
    for (int k = 0; k < 3; ++k)
      hinge.velocity[k] = keep * hinge.velocity[k] + gain * hinge.acceleration[k];
  }
  fastest_ = std::sqrt(fastest);
  move();
  if (!hinges_.empty()) move_hinges();
  write_slots();
}

void Relaxation::move() {
  // Far from balance, nothing turns or moves by more than an element can follow in one step.
  const double share = fastest_ > kLargestTurnOfStep ? kLargestTurnOfStep / fastest_ : 1;
  for (Row& row : rows_) {
    if (share < 1) {
      for (int c = 0; c < 3; ++c) {
        row.velocity[c] *= share;
        row.spin[c] *= share;
      }
    }
    for (int c = 0; c < 3; ++c) row.position[c] += row.velocity[c];
    turn(row.spin, row.rotation);
  }
}

void Relaxation::move_hinges() {
  for (Hinge& hinge : hinges_) {
    const ReleasedEnd& of = structure_.released_ends()[index(hinge.end)];
    const Eigen::Map<const Eigen::Vector3d> angle(hinge.velocity);
    if (of.axes == 3) {
      const Eigen::Matrix3d axes = hinge.turn.toRotationMatrix() * of.rest;
      hinge.turn = rotation_by(axes * angle) * hinge.turn;
    } else {
      hinge.turn = rotation_by(angle[0] * of.rest.col(0)) * hinge.turn;
      if (of.axes == 2) hinge.turn = hinge.turn * rotation_by(angle[1] * of.rest.col(1));
    }
    hinge.turn.normalize();
  }
}

void Relaxation::write_slots() {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    std::copy(rows_[i].position, rows_[i].position + 3, slots_[i].position);
    std::copy(rows_[i].rotation, rows_[i].rotation + 4, slots_[i].rotation);
  }
  for (const Hinge& hinge : hinges_) {
    const ReleasedEnd& of = structure_.released_ends()[index(hinge.end)];
    FrameSlot& slot = slots_[index(structure_.nodes() + hinge.end)];
    std::copy(rows_[index(of.node)].position, rows_[index(of.node)].position + 3, slot.position);
    const Eigen::Quaterniond q = quaternion(rows_[index(of.node)].rotation) * hinge.turn;
    slot.rotation[0] = q.w();
    Eigen::Map<Eigen::Vector3d>(slot.rotation + 1) = q.vec();
  }
}

void Relaxation::drive(const LoadPath& path, double s) {
  const Eigen::VectorXd increments = path.held_increments(state(), s);
  for (int i = 0; i < structure_.nodes(); ++i) {
    Row& row = rows_[index(i)];
    const Eigen::Vector3d move = structure_.node_axes(i) * increments.segment<3>(6 * i);
    const Eigen::Vector3d spin = spin_axes(i) * increments.segment<3>(6 * i + 3);
    if (!move.isZero(0)) Eigen::Map<Eigen::Vector3d>(row.position) += move;
    if (spin.isZero(0)) continue;
    const Eigen::Quaterniond q = rotation_by(spin) * quaternion(row.rotation);
    row.rotation[0] = q.w();
    Eigen::Map<Eigen::Vector3d>(row.rotation + 1) = q.vec();
  }
  write_slots();
}

BeamState Relaxation::state() const {
  BeamState result;
  result.positions.resize(3, structure_.nodes());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    result.positions.col(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::Vector3d>(rows_[i].position);
    result.rotations.push_back(quaternion(rows_[i].rotation).normalized());
  }
  for (const Hinge& hinge : hinges_) result.hinge_turns.push_back(hinge.turn);
  return result;
}

}  // namespace limber::beams::detail
