#pragma once

#include <Eigen/Core>

#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/rod/rod_state.h"

namespace limber::rods::detail {

/// Whether an unknown is a length (its derivative a force) or an angle (a moment).
enum class UnknownKind : char { kLength, kAngle };

/// Largest components of a gradient, by kind.
struct GradientSize {
  double force = 0;
  double moment = 0;
};

/// Measures of a linkage, with its sections as they are scaled, by which forces, moments,
/// eigenvalues and steps are judged, for any units of lengths and stiffnesses.
class UnknownScales {
 public:
  explicit UnknownScales(const LinkageModel& model);

  /// Increase of each diagonal entry by a shift of one, as lengths (for angles: times squares of
  /// arms). The weight of an edge is inverse to its length, as is the effect of its pressure.
  /// Between equal edges it is that of lumped weights of one per length.
  [[nodiscard]] const Eigen::VectorXd& weights() const { return weights_; }
  [[nodiscard]] UnknownKind kind(int unknown) const { return kinds_[unknown]; }

  /// Bending at the size of the whole linkage: EI / extent^4 per weight.
  [[nodiscard]] double softest_eigenvalue() const { return softest_; }
  /// Stretching of an edge: EA / edge^2 per weight.
  [[nodiscard]] double stiffest_eigenvalue() const { return stretching_ / (edge_ * edge_); }
  /// Shift below which the signs of eigenvalues are rounding.
  [[nodiscard]] double rounding_shift() const { return rounding_shift_; }
  /// Reduction of eigenvalues by a force that presses an edge together.
  [[nodiscard]] double pressure_shift(double force) const { return force / (edge_ * edge_); }
  [[nodiscard]] double extent() const { return extent_; }
  [[nodiscard]] double bending() const { return bending_; }
  /// Rounding of one component of a gradient, by its own edges.
  [[nodiscard]] double rounding(int unknown) const { return rounding_[unknown]; }
  /// Rounding of a gradient's force components. @param beyond see there
  [[nodiscard]] double force_rounding(double beyond = 0) const {
    return force_rounding_ + beyond * force_rounding_per_distance_;
  }
  [[nodiscard]] double moment_rounding() const { return force_rounding_ * edge_; }
  /// How much farther from the origin a state lies than the linkage was drawn, >= 0 [length].
  [[nodiscard]] double beyond(const LinkageState& state) const;
  /// Rounding of the elastic energy near a state without stress.
  [[nodiscard]] double energy_rounding(double beyond = 0) const {
    const double force = force_rounding(beyond);
    return force * force / stretching_ * total_length_;
  }

  /// The largest component over the size present of its kind. Rounding of each unknown's own edges
  /// is allowed for in addition to the tolerance.
  /// @param beyond  see there
  [[nodiscard]] double imbalance(const Eigen::Ref<const Eigen::VectorXd>& gradient,
                                 const GradientSize& present, double tolerance,
                                 double beyond = 0) const;
  /// The unknown that has it; -1: nothing is out of balance.
  [[nodiscard]] int most_unbalanced(const Eigen::Ref<const Eigen::VectorXd>& gradient,
                                    const GradientSize& present, double tolerance,
                                    double beyond = 0) const;
  [[nodiscard]] GradientSize size_of(const Eigen::Ref<const Eigen::VectorXd>& gradient) const;
  /// Typical force and moment of rods that hold these energies: those in a rod of the whole length
  /// if they were spread evenly.
  [[nodiscard]] GradientSize present(const RodEnergies& energies) const;

  /// Largest angle that a step turns a joint, opens it by, or turns an edge of a chain by [rad].
  [[nodiscard]] double largest_turn(const LinkageModel& model, const LinkageState& state,
                                    const Eigen::Ref<const Eigen::VectorXd>& step) const;

 private:
  void fill_rounding(const LinkageModel& model);

  Eigen::VectorXd weights_;
  std::vector<UnknownKind> kinds_;
  Eigen::VectorXd rounding_;               // of each component of a gradient
  Eigen::VectorXd rounding_per_distance_;  // from the origin
  double total_length_ = 0;
  double segment_ = 0;  // mean length
  double edge_ = 0;     // mean length
  double extent_ = 0;
  double stretching_ = 0, bending_ = 0, stiffest_bending_ = 0;
  double softest_ = 0, rounding_shift_ = 0, force_rounding_ = 0;
  double farthest_ = 0;  // coordinate of the drawn linkage
  double force_rounding_per_distance_ = 0;
};

}  // namespace limber::rods::detail
