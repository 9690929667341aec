// Measures of a relaxation between its steps.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "engine/beams/solver/relaxation.h"

#include "engine/base/index.h"

namespace limber::beams::detail {

bool Relaxation::drives(int node) const {
  const auto first = structure_.held().begin() + 6 * node;
  return first[0] != 0 && first[1] != 0 && first[2] != 0;
}

double Relaxation::pressure() const {
  double result = 0;
  for (int e = 0; e < structure_.elements(); ++e) {
    const ElementConstants<double>& k = structure_.constants(e);
    const double bending = 0.25 * std::min(k.near_2, k.near_3) * k.length;  // EI
    const BeamElement& element = structure_.model().elements[index(e)];
    if (bending <= 0 || (drives(element.start) && drives(element.finish))) continue;
    const double axial = responses_.data()[responses_.index(e, kAxial)];
    result = std::max(result, -axial * k.length * k.length / (9.87 * bending));
  }
  return result;
}

double Relaxation::bend() const {
  double result = 0;
  const double* const from = responses_.data();
  for (int e = 0; e < structure_.elements(); ++e) {
    const double stiffness =
        std::min(structure_.constants(e).near_2, structure_.constants(e).near_3);
    if (stiffness <= 0) continue;
    for (const int row : {int(kStartMoment), int(kFinishMoment)}) {
      const int at = responses_.index(e, row);
      const double squared = from[at] * from[at] + from[at + kLanes] * from[at + kLanes] +
                             from[at + 2 * kLanes] * from[at + 2 * kLanes];
      result = std::max(result, squared / (stiffness * stiffness));
    }
  }
  return std::sqrt(result);
}

double Relaxation::farthest() const {
  double result = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (used_[i] == 0) continue;
    for (const double coordinate : rows_[i].position)
      result = std::max(result, std::abs(coordinate));
  }
  return result;
}

Relaxation::Residual Relaxation::residual() const {
  Residual result;
  const auto size = [this](int e, int c) {
    return Eigen::Vector3d(responses_.data()[responses_.index(e, c)],
                           responses_.data()[responses_.index(e, c + 1)],
                           responses_.data()[responses_.index(e, c + 2)])
        .norm();
  };
  for (int e = 0; e < structure_.elements(); ++e) {
    result.present_force = std::max(result.present_force, size(e, kForce));
    result.present_moment =
        std::max({result.present_moment, size(e, kStartMoment), size(e, kFinishMoment)});
  }
  result.unbalanced.setZero(structure_.unknowns());
  for (int i = 0; i < structure_.nodes(); ++i) {
    double force[3], moment[3];
    out_of_balance(i, force, moment);
    result.unbalanced.segment<3>(6 * i) =
        structure_.node_axes(i).transpose() * Eigen::Map<const Eigen::Vector3d>(force);
    result.unbalanced.segment<3>(6 * i + 3) =
        spin_axes(i).transpose() * Eigen::Map<const Eigen::Vector3d>(moment);
  }
  for (const Hinge& hinge : hinges_) {
    const ReleasedEnd& of = structure_.released_ends()[index(hinge.end)];
    for (int k = 0; k < of.axes; ++k) result.unbalanced[of.unknown + k] = hinge.moment[k];
  }
  return result;
}

}  // namespace limber::beams::detail
