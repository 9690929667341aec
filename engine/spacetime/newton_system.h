#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/spacetime/block_system.h"
#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/mode_systems.h"
#include "engine/spacetime/newton_guard.h"

namespace limber::spacetime {

/// The full second-order model at the kept frames,
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
  /// x <- H^-1 x, lanes x kept.
  void solve(Lanes& x) const { system_.solve(x); }

 private:
  void tie_knots(int modes, const ConstraintRows& rows, const Lanes& jacobian);

  BlockSystem system_;
  std::vector<BlockSystem::Tie> ties_;
  Eigen::MatrixXd weighted_;
  Eigen::VectorXd term_weight_;
};

}  // namespace limber::spacetime
