#pragma once

#include <Eigen/Core>

#include "engine/base/numerics/banded_cholesky.h"
#include "engine/spacetime/force_rows.h"
#include "engine/spacetime/recovery.h"

namespace limber::spacetime {

/// The energy of a recovery, its derivatives, and the minimisations over part of its variables that
/// are exact. None of these raises the energy.
class RecoveryEnergy {
 public:
  RecoveryEnergy(const Eigen::Ref<const Eigen::MatrixXd>& target, const RecoveryOptions& options);

  [[nodiscard]] const Eigen::MatrixXd& target() const { return target_; }
  [[nodiscard]] double weight() const { return weight_; }
  [[nodiscard]] double column_weight() const { return column_weight_; }

  [[nodiscard]] RecoveryEnergies value(const RecoveredMotion& at) const;
  /// d E / d z, r x N.
  [[nodiscard]] Eigen::MatrixXd gradient_of_motion(const RecoveredMotion& at) const;
  /// d E / d S, R x r.
  [[nodiscard]] Eigen::MatrixXd gradient_of_mixing(const RecoveredMotion& at) const;

  /// The second derivative by z, unknown r * frame + mode. If S is deficient, it has a proximal
  /// term of 1e-10 of the constraints' (about the current motion: only the path depends on it).
  [[nodiscard]] BandedCholesky factor_motion(const RecoveredMotion& at) const;

  /// z <- arg min, the rest unchanged.
  void fit_motion(RecoveredMotion& at) const;
  /// Lambda, D <- arg min.
  void fit_dynamics(RecoveredMotion& at) const;
  /// The scale of each column of S (times a) and its row of z (over a) <- arg min. S z stays.
  void balance(RecoveredMotion& at) const;

 private:
  /// The rows over the frames that count, as if these were the whole time line.
  [[nodiscard]] ForceRows rows_of(const RecoveredMotion& at) const;
  /// A_k z_k over the frames that count.
  [[nodiscard]] Eigen::RowVectorXd force(const ForceRows& rows, const Eigen::MatrixXd& z,
                                         Eigen::Index mode) const;

  Eigen::MatrixXd target_;
  double weight_, column_weight_;
  Eigen::Index driven_;
};

}  // namespace limber::spacetime
