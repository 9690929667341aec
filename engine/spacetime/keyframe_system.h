#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/spacetime/banded_factor.h"
#include "engine/spacetime/block_system.h"
#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/green_blocks.h"
#include "engine/spacetime/mode_systems.h"

namespace limber::spacetime {

/// P with the rows of keyframes in it, P_key = K + proximal I + sum over keyframes of w S^T S at
/// their knots. These rows are linear in z and touch one frame, so P_key keeps the band of K. It is
/// factored once for all iterates, in time linear in the number of keyframes.
///
///   no keyframes      P_key = P, diagonal in the modes: the existing factor
///   S = (I, 0)^T      w I: diagonal in the modes still, one number more a frame and mode
///   any other S       w S^T S couples the modes of a frame: BlockSystem
class KeyframeSystem {
 public:
  /// Knots, dynamics, ends or S may have changed.
  void forget() { known_ = false; }
  /// Factors P_key, if it or its weights are not as they were.
  void factor(const ModeSystems& systems, const ConstraintRows& rows);

  /// x <- P_key^-1 x, lanes x kept.
  void solve(const ModeSystems& systems, Lanes& x) const;
  /// The lower triangle of J P_key^-1 J^T over the rows of positions and velocities.
  /// @param jacobian  lanes x terms
  void response(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& jacobian,
                Eigen::MatrixXd& system);

 private:
  enum class Form { kPlain, kDiagonal, kBlocks };
  void factor_diagonal(const ModeSystems& systems, const ConstraintRows& rows);
  void factor_blocks(const ModeSystems& systems, const ConstraintRows& rows);
  [[nodiscard]] const GreenBlocks& green(const ModeSystems& systems) const {
    return form_ == Form::kPlain ? systems.green() : green_;
  }
  /// half_ <- F^-1 J^T over the terms of positions and velocities.
  void half_response(const ModeSystems& systems, const ConstraintRows& rows, const Lanes& jacobian);

  bool known_ = false;
  Form form_ = Form::kPlain;
  Eigen::VectorXd weights_;  // per knot
  BandedFactor band_;
  GreenBlocks green_;  // between the knots of positions
  BlockSystem blocks_;
  Lanes scaled_;
  Eigen::MatrixXd half_;
  std::vector<int> starts_;
};

}  // namespace limber::spacetime
