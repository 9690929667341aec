#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/mode_systems.h"
#include "engine/spacetime/newton_guard.h"

namespace limber::spacetime {

/// The full second-order model at the kept frames,
///   H = K + proximal I + blocks at the knots of (J^T W J - theta sum_a m_a d2 u_a / dz2 + shift
///   I),
/// K diagonal in the modes and at most three kept frames wide, the knots' blocks dense in the
/// modes:
///
///        f0  f1  f2  f3          f: kept frames, each r x r
///   f0 [ B   d   d   d     ]     B: dense (a knot), d: diagonal
///   f1 [ d   d   d   d     ]
///   f2 [ d   d   B   d   d ]
///   f3 [ d   d   d   d   d ]
///
/// factored by block Cholesky inside this envelope: time linear in the number of knots, cubic in r.
class NewtonSystem {
 public:
  /// @param curvature  per knot sum_a m_a d2 u_a / dz2, r x r
  /// @param guard      theta and the shift
  /// @returns false if H is not positive definite
  [[nodiscard]] bool factor(const ModeSystems& systems, const ConstraintRows& rows,
                            const Lanes& jacobian, const std::vector<Eigen::MatrixXd>& curvature,
                            const NewtonGuard& guard);
  /// x <- H^-1 x, lanes x kept.
  void solve(Lanes& x) const;

 private:
  static constexpr int kBand = 3;
  [[nodiscard]] Eigen::MatrixXd& block(int row, int column) {
    return blocks_[static_cast<std::size_t>(row * (kBand + 1) + (row - column))];
  }
  [[nodiscard]] const Eigen::MatrixXd& block(int row, int column) const {
    return blocks_[static_cast<std::size_t>(row * (kBand + 1) + (row - column))];
  }
  [[nodiscard]] char& filled(int row, int column) {
    return filled_[static_cast<std::size_t>(row * (kBand + 1) + (row - column))];
  }
  [[nodiscard]] char filled(int row, int column) const {
    return filled_[static_cast<std::size_t>(row * (kBand + 1) + (row - column))];
  }
  void assemble(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& jacobian,
                const std::vector<Eigen::MatrixXd>& curvature, const NewtonGuard& guard);

  int count_ = 0, modes_ = 0;
  std::vector<Eigen::MatrixXd> blocks_;  // [row][row - column]: H, then its Cholesky factor
  std::vector<char> filled_;
  Eigen::MatrixXd weighted_;
};

}  // namespace limber::spacetime
