#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/rods/equilibrium/conditions.h"
#include "engine/rods/linkage/linkage_state.h"
#include "engine/rods/solver/condensed_matrix.h"

namespace limber::rods::detail {

/// A point between two neighbouring vertices of a segment, or the middle of a joint.
struct SpringPoint {
  int joint = -1;    // >= 0: the joint's
  int segment = -1;  // else (1 - share) x_edge + share x_(edge + 1)
  int edge = 0;
  double share = 0;
  Eigen::Vector3d target;
  double stiffness;
};

/// Springs, loads and weight as a potential beside the elastic energy:
///
///   sum of k/2 |x - target|^2 - forces . x - torques alpha - moments . omega
class ConditionTerms {
 public:
  /// @pre conditions are valid for the model, which outlives this
  ConditionTerms(const LinkageModel& model, const Conditions& conditions);

  struct Potential {
    double springs = 0;
    double loads = 0;
    double size = 0;  // sum of magnitudes, of which rounding takes a share
    [[nodiscard]] double total() const { return springs + loads; }
  };
  /// Without the work of moments, which have no potential.
  [[nodiscard]] Potential potential(const LinkageState& state) const;
  /// Minus the work of moments over a step.
  [[nodiscard]] double moment_potential(const Eigen::Ref<const Eigen::VectorXd>& step) const {
    return -moments_.dot(step);
  }

  /// The moment on an unknown of a joint's rotation, else 0.
  [[nodiscard]] const Eigen::VectorXd& moments() const { return moments_; }

  /// Adds to the result of LinkageAssembly::hessian. The matrix of a moment is skew and has no part
  /// in a symmetric one: MomentTangent has it.
  void add(const LinkageState& state, Eigen::VectorXd& gradient, CondensedMatrix& hessian) {
    add_both(state, gradient, &hessian);
  }
  void add_gradient(const LinkageState& state, Eigen::VectorXd& gradient) {
    add_both(state, gradient, nullptr);
  }

  [[nodiscard]] const std::vector<SpringPoint>& springs() const { return springs_; }
  [[nodiscard]] Eigen::Vector3d place(const LinkageState& state, const SpringPoint& spring) const;
  /// Force of a spring on the linkage [force].
  [[nodiscard]] Eigen::Vector3d pull(const LinkageState& state, const SpringPoint& spring) const {
    return spring.stiffness * (spring.target - place(state, spring));
  }
  /// Part of the last gradient due to springs and weight on the edge at a segment's end, by the
  /// unknowns of the joint there. @param state of that gradient
  [[nodiscard]] Eigen::Matrix<double, kJointUnknowns, 1> end_gradient(const LinkageState& state,
                                                                      int segment, End end) const;
  /// Rod of a segment.
  [[nodiscard]] Eigen::Vector3d weight(int segment) const;
  /// Forces and torques at joints, along their unknowns.
  [[nodiscard]] const Eigen::VectorXd& joint_loads() const { return loads_; }
  /// Sums of the weights, forces and moments on each component, and of their magnitudes.
  struct Resultant {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    double magnitudes = 0;                             // of forces
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // of moments alone, not of forces' arms
    double moment_magnitudes = 0;
  };
  [[nodiscard]] std::vector<Resultant> resultants() const;
  /// Largest force and moment that loads and springs bring, for scales.
  [[nodiscard]] double largest_force(const LinkageState& state) const;
  [[nodiscard]] double largest_moment() const { return largest_moment_; }

 private:
  using EndGradient = Eigen::Matrix<double, kTerminalNumbers, 1>;

  void weigh(const Gravity& gravity);
  void add_to_vertex(int segment, int vertex, const Eigen::Vector3d& value,
                     Eigen::Ref<Eigen::VectorXd> gradient);
  void add_both(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                CondensedMatrix* hessian);
  void add_ends(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                CondensedMatrix* hessian);

  const LinkageModel& model_;
  std::vector<SpringPoint> springs_;
  Eigen::VectorXd loads_;
  Eigen::VectorXd moments_;                           // by unknown, rotations only
  Eigen::Vector3d weight_ = Eigen::Vector3d::Zero();  // per length
  std::vector<int> first_vertex_;                     // of each segment in vertex_lengths_
  std::vector<double> vertex_lengths_;                // of rod that each vertex carries
  std::vector<EndGradient> ends_;                     // by terminal numbers, 2 segment + end
  std::vector<char> touched_;
  double largest_load_ = 0;
  double largest_moment_ = 0;
};

}  // namespace limber::rods::detail
