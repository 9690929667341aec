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
/// modes. Kept frames are taken together in groups, mostly a knot and the frame behind it, such
/// that none couples to more than the next group:
///
///        f0  f1 | f2  f3        f: kept frames, each r x r
///   f0 [ B   d  | d   d  ]      B: dense (a knot), d: diagonal
///   f1 [ d   d  | d   d  ]
///      ------------------
///   f2 [ d   d  | B   d  ]
///   f3 [ d   d  | d   d  ]
///
/// and factored by block tridiagonal Cholesky: time linear in the number of knots, cubic in r.
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
  void group_frames(const ModeSystems& systems);
  void assemble(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& jacobian,
                const std::vector<Eigen::MatrixXd>& curvature, const NewtonGuard& guard);
  [[nodiscard]] int group_count() const { return static_cast<int>(first_.size()) - 1; }
  /// Where a frame's modes begin in its group.
  [[nodiscard]] Eigen::Index place(int frame) const;

  int modes_ = 0;
  std::vector<int> first_;     // kept frame that each group begins with; last: their number
  std::vector<int> group_of_;  // per kept frame
  std::vector<Eigen::MatrixXd> diagonal_;  // per group: H, then its Cholesky factor (lower)
  std::vector<Eigen::MatrixXd> below_;     // per group: rows of the next group, the same
  Eigen::MatrixXd weighted_;
  mutable Eigen::VectorXd x_;
};

}  // namespace limber::spacetime
