#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/equilibrium/condition_terms.h"
#include "engine/rods/equilibrium/unknown_scales.h"

namespace limber::rods::detail {

/// Constraints on unknowns: pins, set angles, the mean angle, and a fixed joint of each component
/// that floats in space.
///
/// A component without pins, springs and forces has one joint held: its reactions vanish, so which
/// one it is does not matter for the shape. A component that springs or loads touch but do not hold
/// entirely gets a weak stiffness instead, at one joint, against those rigid motions that no spring
/// resists. It acts on steps, not on forces, and so does not move the equilibrium.
class Holding {
 public:
  Holding(const LinkageModel& model, const Conditions& conditions, const ConditionTerms& terms,
          const UnknownScales& scales, const LinkageState& state);

  /// Unknowns that stay or move as prescribed, in ascending order.
  [[nodiscard]] const std::vector<int>& pinned() const { return pinned_; }
  [[nodiscard]] bool is_pinned(int unknown) const { return is_pinned_[unknown] != 0; }

  /// Differences between prescribed and present values.
  struct Gap {
    Eigen::VectorXd pinned;  // by unknown, zero where nothing is prescribed
    Eigen::VectorXd rows;    // of the constraints, after the pinned unknowns have moved
    double size = 0;         // the largest, lengths as shares of the linkage's extent
  };
  [[nodiscard]] Gap gap(const LinkageState& state) const;

  /// Linear constraints: none, or the mean of the angles; zero at pinned unknowns.
  [[nodiscard]] const Eigen::MatrixXd& rows() const { return rows_; }

  /// Removes from a gradient the parts that pins and constraints balance.
  /// @returns the force of the mean angle's constraint, 0 without one
  double remove_reactions(Eigen::Ref<Eigen::VectorXd> gradient) const;

  void add_weak_holds(CondensedMatrix& hessian) const;

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  struct Prescribed {
    int unknown;
    int joint;
    double value;  // angle or coordinate
  };
  struct WeakHold {
    int joint;
    Matrix6 stiffness;  // by position and rotation
  };

  void pin(int unknown);
  void hold_floating(const ConditionTerms& terms, const UnknownScales& scales,
                     const LinkageState& state, std::vector<char> held);
  [[nodiscard]] int central_joint(int component) const;

  const LinkageModel& model_;
  std::vector<int> joint_components_;
  std::vector<int> pinned_;
  std::vector<char> is_pinned_;
  std::vector<Prescribed> prescribed_;
  std::vector<WeakHold> weak_;
  Eigen::MatrixXd rows_;
  double mean_angle_ = 0;
  double extent_;
};

/// Lengths of joints' edges, as unknowns, that are as short as they may be and would become
/// shorter.
/// @param gradient  of the potential, by all unknowns
/// @param shortest  share of the rest length, see Conditions::shortest_joint_edge
[[nodiscard]] std::vector<int> lengths_on_their_bound(const LinkageModel& model,
                                                      const LinkageState& state,
                                                      const Eigen::VectorXd& gradient,
                                                      double shortest);

/// Resistance of springs to rigid motions of a component: a shift, and a turn about a point. The
/// turn counts by its motion at a distance of a size [length].
struct SpringHold {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  SpringHold(const LinkageModel& model, const ConditionTerms& terms, const LinkageState& state,
             int component, const Eigen::Vector3d& about, double size);
  bool touches = false;  // is there a spring
  Matrix6 stiffness = Matrix6::Zero();
  /// Columns: unit directions that they do not resist, nearly.
  [[nodiscard]] Eigen::Matrix<double, 6, Eigen::Dynamic> unresisted() const;
};

/// Component of each joint.
[[nodiscard]] std::vector<int> joint_components(const LinkageGraph& graph);

}  // namespace limber::rods::detail
