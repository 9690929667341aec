#include "engine/beams/element/spread_load.h"

#include <Eigen/Geometry>

#include "engine/base/rotations/exponential_map.h"

namespace limber::beams {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Rows of the twelve.
enum Row { kStartMove = 0, kStartTurn = 3, kFinishMove = 6, kFinishTurn = 9 };

// Integrals of (1 - s) h and s h of the cubic's functions: values and tangents, near and far.
constexpr double kNear = 7.0 / 20, kFar = 3.0 / 20, kNearTangent = 1.0 / 20, kFarTangent = 1.0 / 30;

/// Second derivatives of u . e by a spin of e.
Matrix3d turned_twice(const Vector3d& u, const Vector3d& e) {
  return 0.5 * (u * e.transpose() + e * u.transpose()) - u.dot(e) * Matrix3d::Identity();
}

/// The load along a released axis e of the end that carries it: its place along e is measured from
/// that end. To the potential this adds (q . e)(e . gap), gap from there to the cubic's mean.
class Slide {
 public:
  Slide(const LoadTransfer& transfer, const ElementEnds& ends, std::size_t axis)
      : carrier_(transfer.carriers[axis]) {
    if (carrier_ == Carrier::kBoth) return;
    const bool at_start = carrier_ == Carrier::kStart;
    const auto column = static_cast<Eigen::Index>(axis);
    e_ = at_start ? ends.start_axes.col(column) : ends.finish_axes.col(column);
    spin_ = at_start ? kStartTurn : kFinishTurn;
    other_spin_ = at_start ? kFinishTurn : kStartTurn;
    other_ = at_start ? ends.finish_axes.col(0) : ends.start_axes.col(0);
    sign_ = at_start ? 0.5 : -0.5;
    arm_ = 0.5 * transfer.lever;
    reach_ = ends.finish - ends.start - arm_ * (ends.start_axes.col(0) + ends.finish_axes.col(0));
    // Tangents at the end itself turn with e.
    free_reach_ = ends.finish - ends.start - arm_ * other_;
  }

  [[nodiscard]] bool exists() const { return carrier_ != Carrier::kBoth; }
  [[nodiscard]] double value(const Vector3d& q) const { return q.dot(e_) * gap(); }

  [[nodiscard]] ElementVector gradient(const Vector3d& q) const {
    return gap() * of_load(q) + q.dot(e_) * of_gap();
  }

  [[nodiscard]] ElementMatrix hessian(const Vector3d& q) const {
    const ElementVector load = of_load(q), gap_slope = of_gap();
    ElementMatrix h = load * gap_slope.transpose() + gap_slope * load.transpose();
    h.block<3, 3>(spin_, spin_) += gap() * turned_twice(q, e_);
    const double weight = sign_ * q.dot(e_);
    const Matrix3d by_chord = -weight * rotations::cross_matrix(e_);
    add_mixed(kFinishMove, spin_, by_chord, h);
    add_mixed(kStartMove, spin_, -by_chord, h);
    h.block<3, 3>(spin_, spin_) += weight * turned_twice(free_reach_, e_);
    h.block<3, 3>(other_spin_, other_spin_) -= weight * arm_ * turned_twice(e_, other_);
    add_mixed(spin_, other_spin_,
              -weight * arm_ * (e_.dot(other_) * Matrix3d::Identity() - other_ * e_.transpose()),
              h);
    return h;
  }

  /// Derivative of the gradient by the load.
  [[nodiscard]] Eigen::Matrix<double, 12, 3> by_load() const {
    Eigen::Matrix<double, 12, 3> result = of_gap() * e_.transpose();
    result.block<3, 3>(spin_, 0) += gap() * rotations::cross_matrix(e_);
    return result;
  }

 private:
  static void add_mixed(int row, int column, const Matrix3d& block, ElementMatrix& h) {
    h.block<3, 3>(row, column) += block;
    h.block<3, 3>(column, row) += block.transpose();
  }
  [[nodiscard]] double gap() const { return sign_ * e_.dot(reach_); }
  [[nodiscard]] ElementVector of_load(const Vector3d& q) const {
    ElementVector result = ElementVector::Zero();
    result.segment<3>(spin_) = e_.cross(q);
    return result;
  }
  [[nodiscard]] ElementVector of_gap() const {
    ElementVector result = ElementVector::Zero();
    result.segment<3>(kStartMove) = -sign_ * e_;
    result.segment<3>(kFinishMove) = sign_ * e_;
    result.segment<3>(spin_) = sign_ * e_.cross(free_reach_);
    result.segment<3>(other_spin_) = -sign_ * arm_ * other_.cross(e_);
    return result;
  }

  Carrier carrier_;
  Vector3d e_, other_, reach_, free_reach_;  // other_: axis 1 of the other end
  int spin_ = 0, other_spin_ = 0;
  double sign_ = 0, arm_ = 0;
};

constexpr std::size_t kAxes = 3;

}  // namespace

ElementVector spread_forces(const LoadTransfer& transfer, const ElementEnds& ends,
                            const SpreadLoad& load) {
  ElementVector forces;
  forces.segment<3>(kStartMove) = kNear * load.start + kFar * load.finish;
  forces.segment<3>(kFinishMove) = kFar * load.start + kNear * load.finish;
  forces.segment<3>(kStartTurn) =
      transfer.lever *
      ends.start_axes.col(0).cross(kNearTangent * load.start + kFarTangent * load.finish);
  forces.segment<3>(kFinishTurn) =
      -transfer.lever *
      ends.finish_axes.col(0).cross(kFarTangent * load.start + kNearTangent * load.finish);
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    if (const Slide slide(transfer, ends, axis); slide.exists())
      forces -= slide.gradient(load.resultant());
  }
  return forces;
}

double spread_potential(const LoadTransfer& transfer, const ElementEnds& ends,
                        const Vector3d& resultant) {
  const Vector3d mean = 0.5 * (ends.start + ends.finish) +
                        transfer.lever / 12 * (ends.start_axes.col(0) - ends.finish_axes.col(0));
  double potential = -resultant.dot(mean);
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    if (const Slide slide(transfer, ends, axis); slide.exists())
      potential += slide.value(resultant);
  }
  return potential;
}

ElementMatrix spread_hessian(const LoadTransfer& transfer, const ElementEnds& ends,
                             const Vector3d& resultant) {
  ElementMatrix h = ElementMatrix::Zero();
  const Vector3d pull = transfer.lever / 12 * resultant;
  h.block<3, 3>(kStartTurn, kStartTurn) = -turned_twice(pull, ends.start_axes.col(0));
  h.block<3, 3>(kFinishTurn, kFinishTurn) = turned_twice(pull, ends.finish_axes.col(0));
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    if (const Slide slide(transfer, ends, axis); slide.exists()) h += slide.hessian(resultant);
  }
  return h;
}

ElementMatrix following_derivative(const LoadTransfer& transfer, const ElementEnds& ends,
                                   const SpreadLoad& load) {
  ElementMatrix d = ElementMatrix::Zero();
  const Matrix3d turn_start = -rotations::cross_matrix(load.start),
                 turn_finish = -rotations::cross_matrix(load.finish);
  const Matrix3d start_arm = transfer.lever * rotations::cross_matrix(ends.start_axes.col(0)),
                 finish_arm = -transfer.lever * rotations::cross_matrix(ends.finish_axes.col(0));
  d.block<3, 3>(kStartMove, kStartTurn) = kNear * turn_start;
  d.block<3, 3>(kStartMove, kFinishTurn) = kFar * turn_finish;
  d.block<3, 3>(kFinishMove, kStartTurn) = kFar * turn_start;
  d.block<3, 3>(kFinishMove, kFinishTurn) = kNear * turn_finish;
  d.block<3, 3>(kStartTurn, kStartTurn) = kNearTangent * start_arm * turn_start;
  d.block<3, 3>(kStartTurn, kFinishTurn) = kFarTangent * start_arm * turn_finish;
  d.block<3, 3>(kFinishTurn, kStartTurn) = kFarTangent * finish_arm * turn_start;
  d.block<3, 3>(kFinishTurn, kFinishTurn) = kNearTangent * finish_arm * turn_finish;
  // Arms turn, too: (omega x x_1) x pull.
  const Vector3d start_pull = kNearTangent * load.start + kFarTangent * load.finish,
                 finish_pull = kFarTangent * load.start + kNearTangent * load.finish;
  d.block<3, 3>(kStartTurn, kStartTurn) += rotations::cross_matrix(start_pull) * start_arm;
  d.block<3, 3>(kFinishTurn, kFinishTurn) += rotations::cross_matrix(finish_pull) * finish_arm;
  for (std::size_t axis = 0; axis < kAxes; ++axis) {
    const Slide slide(transfer, ends, axis);
    if (!slide.exists()) continue;
    // Along exp second derivatives are the symmetric part of how moments change.
    const ElementVector gradient = slide.gradient(load.resultant());
    d -= slide.hessian(load.resultant());
    for (const int spin : {kStartTurn, kFinishTurn})
      d.block<3, 3>(spin, spin) +=
          0.5 * rotations::cross_matrix(Vector3d(gradient.segment<3>(spin)));
    d.block<12, 3>(0, kStartTurn) -= 0.5 * slide.by_load() * turn_start;
    d.block<12, 3>(0, kFinishTurn) -= 0.5 * slide.by_load() * turn_finish;
  }
  return d;
}

}  // namespace limber::beams
