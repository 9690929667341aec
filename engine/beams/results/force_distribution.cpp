#include "engine/beams/results/force_distribution.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "engine/base/index.h"

namespace limber::beams {

namespace {

using Eigen::Vector3d;

// Deflection of a clamped span under an even load, s^2 (1 - s)^2 q L^4 / (24 EI), and how tension
// reduces it: Galerkin's method with that shape.
constexpr double kDeflection = 24, kTension = 42;
/// Pressed by more, the span itself buckles: nothing tells its deflection.
constexpr double kLeastStiffness = 0.1;
/// Sine below which axes 2 of both ends do not say where that of the section is.
constexpr double kNoAxis = 1e-6;

double deflection_factor(double bending, double length, double axial) {
  if (!(bending > 0)) return 0;
  const double stiffness =
      std::max(kLeastStiffness, 1 + axial * length * length / (kTension * bending));
  return length * length * length / (kDeflection * bending * stiffness);
}

}  // namespace

ElementForceDistribution::ElementForceDistribution(const BeamStructure& structure,
                                                   const NodeLoads& loads, const BeamState& state,
                                                   int element) {
  const ElementEnds ends = structure.ends(state, element);
  const ElementConstants<double>& k = structure.constants(element);
  const BeamElement& of = structure.model().elements[index(element)];
  const LoadTransfer transfer = load_transfer(structure, element);
  const SpreadLoad load = load_over(structure, loads, ends, element);
  is_cable_ = of.kind == BeamKind::kCable;
  start_axes_ = ends.start_axes;
  finish_axes_ = ends.finish_axes;
  load_ = load.start;
  load_change_ = load.finish - load.start;
  ElementVector on_ends = element_gradient(k, ends);
  if (!load.is_zero()) on_ends -= spread_forces(transfer, ends, load);
  force_ = on_ends.segment<3>(0);
  moment_ = on_ends.segment<3>(3);
  set_shape(ends, transfer.lever);
  const auto& carriers = transfer.carriers;
  const bool slides = std::any_of(carriers.begin(), carriers.end(),
                                  [](Carrier carrier) { return carrier != Carrier::kBoth; });
  if (is_cable_ || slides || load.is_zero()) return;
  const double axial =
      -0.5 *
      (force_ + Vector3d(force_ + load.resultant())).dot((ends.finish - ends.start).normalized());
  add_particular_deflection(structure.model().sections[index(of.section)], k.length, axial);
}

void ElementForceDistribution::set_shape(const ElementEnds& ends, double length) {
  const Vector3d chord = ends.finish - ends.start;
  if (length == 0) {
    linear_ = chord;
    square_.setZero();
    cubic_.setZero();
    return;
  }
  const Vector3d from = length * ends.start_axes.col(0), to = length * ends.finish_axes.col(0);
  linear_ = from;
  square_ = 3 * chord - 2 * from - to;
  cubic_ = from + to - 2 * chord;
}

void ElementForceDistribution::add_particular_deflection(const BeamSection& section, double length,
                                                         double axial) {
  const Vector3d load = load_ + 0.5 * load_change_;
  const Vector3d axis_2 = (start_axes_.col(1) + finish_axes_.col(1)).normalized();
  const Vector3d axis_3 = (start_axes_.col(2) + finish_axes_.col(2)).normalized();
  particular_ = deflection_factor(section.bending_3, length, axial) * load.dot(axis_2) * axis_2 +
                deflection_factor(section.bending_2, length, axial) * load.dot(axis_3) * axis_3;
}

SectionForces ElementForceDistribution::at(double s) const {
  const double s2 = s * s, s3 = s2 * s, rest = 1 - s;
  const Vector3d force = -(force_ + s * load_ + 0.5 * s2 * load_change_);
  SectionForces result;
  if (is_cable_) {
    result.axial = force.norm();
    return result;
  }
  const Vector3d place =
      s * linear_ + s2 * square_ + s3 * cubic_ + (s2 * rest * rest) * particular_;
  // Arms of the load before the cut, about the start: for its value there, and for its change.
  const Vector3d moved = s2 * (linear_ / 2 + s / 3 * square_ + s2 / 4 * cubic_);
  const Vector3d moved_by_change = s3 * (linear_ / 3 + s / 4 * square_ + s2 / 5 * cubic_);
  const Vector3d moment =
      -moment_ - place.cross(force) - moved.cross(load_) - moved_by_change.cross(load_change_);
  const Vector3d axis_1 =
      (linear_ + 2 * s * square_ + 3 * s2 * cubic_ + (2 * s * rest * (1 - 2 * s)) * particular_)
          .normalized();
  const auto across = [&axis_1](const Vector3d& v) -> Vector3d {
    return v - v.dot(axis_1) * axis_1;
  };
  Vector3d axis_2 = across(rest * start_axes_.col(1) + s * finish_axes_.col(1));
  if (!(axis_2.norm() > kNoAxis)) axis_2 = across(start_axes_.col(1));
  axis_2.normalize();
  const Vector3d axis_3 = axis_1.cross(axis_2);
  result.axial = force.dot(axis_1);
  result.shear_2 = force.dot(axis_2);
  result.shear_3 = force.dot(axis_3);
  result.torque = moment.dot(axis_1);
  result.moment_2 = moment.dot(axis_2);
  result.moment_3 = moment.dot(axis_3);
  return result;
}

SectionForces ForceDistributions::at(int element, double share) const {
  const int first = first_part_[index(element)], count = first_part_[index(element + 1)] - first;
  const double place = share * count;
  const int part = std::clamp(static_cast<int>(place), 0, count - 1);
  return parts_[index(first + part)].at(std::clamp(place - part, 0.0, 1.0));
}

}  // namespace limber::beams
