#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams::detail {

/// Forces and moments that are present in a structure.
struct PresentForces {
  double force = 0;
  double moment = 0;
};

/// The largest residual of a state, scaled, and where it is.
struct Imbalance {
  double scaled = 0;
  int unknown = -1;
};

/// Treatment of the forces that rounding of places leaves in stiff elements: left out, or part of
/// the imbalance.
enum class Rounding { kForgiven, kCounted };

/// Measures by which forces, moments, steps and eigenvalues are judged, for any units.
class Balance {
 public:
  explicit Balance(const BeamStructure& structure);

  /// Largest force and moment at ends of elements and of loads; each is at least what the other
  /// would give over the thickness or over the whole structure.
  [[nodiscard]] PresentForces present(const BeamState& state, const NodeLoads& loads) const;

  /// The same where the largest force and moment of elements are known.
  [[nodiscard]] PresentForces present(PresentForces in_elements, const NodeLoads& loads) const;

  /// Imbalance for a residual by all unknowns; held ones are not read. The part that rounding
  /// leaves counts as zero if it is forgiven.
  [[nodiscard]] Imbalance imbalance(const Eigen::VectorXd& residual, const PresentForces& present,
                                    Rounding rounding = Rounding::kForgiven) const;

  /// Lengths for translations, lengths times squared lengths of elements for rotations: what shifts
  /// of the stiffness are multiplied with. By unknown.
  [[nodiscard]] const Eigen::VectorXd& weights() const { return weights_; }
  /// EI / extent^4: bending at the size of the whole structure, per weight.
  [[nodiscard]] double softest() const { return softest_; }
  /// EA / length^2 of the stiffest element, per weight.
  [[nodiscard]] double stiffest() const { return stiffest_; }
  [[nodiscard]] double extent() const { return extent_; }
  /// Largest turn of a node, or move of one end of an element against the other over its length,
  /// that increments make [rad].
  [[nodiscard]] double size_of(const Eigen::VectorXd& increments) const;
  /// D^3 E [v, v] of the potential along a step v, by differences of residuals. Steps along
  /// v - K^-1 D^3 E [v, v] / 2 keep the lengths of slender beams.
  /// @param residual  VectorXd residual(BeamState)
  /// @param here      at the state
  template <class Residual>
  [[nodiscard]] Eigen::VectorXd third_derivative(const Residual& residual, const BeamState& state,
                                                 const Eigen::VectorXd& here,
                                                 const Eigen::VectorXd& step) const {
    const double e = 1e-3 / std::max(size_of(step), 1e-3);
    const Eigen::VectorXd difference = residual(structure_.moved(state, e * step)) +
                                       residual(structure_.moved(state, -e * step)) - 2 * here;
    return difference / (e * e);
  }
  [[nodiscard]] bool is_force(int unknown) const;
  [[nodiscard]] int node_of(int unknown) const;  // -1 of -1
  /// Largest coordinate as drawn.
  [[nodiscard]] double farthest() const { return farthest_; }

 private:
  const BeamStructure& structure_;
  Eigen::VectorXd weights_, rounding_;
  std::vector<double> arm_;  // per node: mean length of its elements
  double softest_ = 0, stiffest_ = 0, extent_ = 0, thickness_ = 0, farthest_ = 0;
};

}  // namespace limber::beams::detail
