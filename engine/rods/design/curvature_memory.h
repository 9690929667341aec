#pragma once

#include <Eigen/Core>
#include <deque>

namespace limber::rods::detail {

/// Knowledge of a Hessian from products with it, as a positive definite matrix M near to it. The
/// directions of earlier conjugate gradients precondition later ones (Morales and Nocedal 2000),
/// and measure steps: stiff directions move less than soft ones.
class CurvatureMemory {
 public:
  /// @param curved  the Hessian times v; directions of no positive curvature teach nothing
  void note(const Eigen::VectorXd& v, const Eigen::VectorXd& curved);
  void forget() { pairs_.clear(); }
  [[nodiscard]] bool empty() const { return pairs_.empty(); }

  /// M^-1 v by its two loops (Nocedal 1980). @returns v where nothing is known
  [[nodiscard]] Eigen::VectorXd inverse_times(Eigen::VectorXd v) const;
  /// The square root of v^T M v.
  [[nodiscard]] double size(const Eigen::VectorXd& v) const;

 private:
  static constexpr std::size_t kMaxPairs = 60;  // stored products: the oldest are dropped beyond
  struct Pair {
    Eigen::VectorXd v, curved;
    double curvature;  // v^T curved
  };
  /// Curvature of directions that nothing is known of.
  [[nodiscard]] double typical() const;

  std::deque<Pair> pairs_;  // the latest last
};

}  // namespace limber::rods::detail
