#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "engine/spacetime/block_system.h"
#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/mode_systems.h"
#include "engine/spacetime/newton_guard.h"
#include "engine/spacetime/row_products.h"

namespace limber::spacetime {

/// The full second-order model at the kept frames:
///   H = K + proximal I + blocks at the knots of (J^T W J - theta sum_a m_a d2 u_a / dz2 + shift
///   I), and blocks of J^T W J between the two knots of a velocity.
class NewtonSystem {
 public:
  /// @param curvature  per knot sum_a m_a d2 u_a / dz2, r x r
  /// @param guard      theta and the shift
  /// @returns false if H is not positive definite
  [[nodiscard]] bool factor(const ModeSystems& systems, const ConstraintRows& rows,
                            const Lanes& jacobian, const std::vector<Eigen::MatrixXd>& curvature,
                            const NewtonGuard& guard);
  /// The same without curvature and shift: K + proximal I + J^T W J.
  [[nodiscard]] bool factor_first_order(const ModeSystems& systems, const ConstraintRows& rows,
                                        const Lanes& jacobian);
  /// x <- H^-1 x, lanes x kept.
  void solve(Lanes& x) const { system_.solve(x); }
  /// H d = r + J^T W c, m = W (c - J d). @param d  r, then d
  void saddle(const ConstraintRows& rows, const RowProducts& products, const Eigen::VectorXd& c,
              Lanes& d, Eigen::VectorXd& m);

 private:
  /// Adds to the r x r block of a knot.
  using Curve = std::function<void(int knot, Eigen::Ref<Eigen::MatrixXd> block)>;
  [[nodiscard]] bool factor_with(const ModeSystems& systems, const ConstraintRows& rows,
                                 const Lanes& jacobian, const Curve& curve);
  void tie_knots(int modes, const ConstraintRows& rows, const Lanes& jacobian);

  BlockSystem system_;
  std::vector<BlockSystem::Tie> ties_;
  Eigen::MatrixXd weighted_;
  Eigen::VectorXd term_weight_, along_;
};

}  // namespace limber::spacetime
