#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/base/job.h"
#include "engine/base/random.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/reduced/pose_data.h"

namespace limber::reduced {

/// Cubature with a full map per tet, exact to first order at z = 0:
///   q = B^T W z + sum over tets of H_e r(y_e),   r(y) = g(y) - g'(0) y,  y = (Q W)^c z.
/// Only the part of g beyond its linearisation is fitted, so small poses are right for any H.
/// For a free body sum_e H_e is held at the map A from a matrix X to the field X (x - centre). With
/// the same rotation in every tet, q is then that of the rigid body, for any angle.
class FittedCubature {
 public:
  /// @param modes       W-hat, 3n x R
  /// @param linear      B^T W-hat, h x R
  /// @param train       S poses that H is fitted to; the first S" of them rank the tets
  /// @param validation  poses that choose the ridge
  /// @param pool        tets that may be selected
  /// @param affine      A, h x 9, of a free body whose basis spans these fields; else empty
  FittedCubature(const bodies::GradientOperator& gradient, const Eigen::MatrixXd& modes,
                 Eigen::MatrixXd linear, const PoseData& train, const PoseData& validation,
                 std::vector<int> pool, Eigen::MatrixXd affine);

  /// Adds the tet of the pool whose nine features, made orthogonal to those already there, take
  /// most off the residual. False if no tet of the pool improves the fit.
  bool add_best_tet(const JobContext& job);

  [[nodiscard]] const std::vector<int>& tets() const { return tets_; }

  struct Fit {
    Eigen::MatrixXd map;  // H, h x 9T
    double ridge = 0;     // relative to the largest eigenvalue of the features' Gram matrix
    Eigen::VectorXd validation_mean;  // mean relative error on the validation poses, per basis size
                                      // (entry h - 1)
  };
  /// Ridge regression on the tets selected so far; the ridge is the one that is best on the
  /// validation poses.
  [[nodiscard]] Fit fit() const;

  /// The model's members for a map: (QW)^c, and D such that q = H g(Y z) + D z.
  [[nodiscard]] const Eigen::MatrixXd& rs_modes() const { return rs_modes_; }
  [[nodiscard]] Eigen::MatrixXd direct(const Eigen::MatrixXd& map) const;

 private:
  void append_features(int tet);

  const bodies::GradientOperator& gradient_;
  const Eigen::MatrixXd& modes_;
  Eigen::MatrixXd linear_;
  Eigen::MatrixXd affine_;
  const PoseData& train_;
  const PoseData& validation_;
  std::vector<int> pool_;
  std::vector<int> tets_;
  Eigen::MatrixXd rs_modes_;             // 9T x R
  Eigen::MatrixXd pool_features_;        // S" x 9C, weighted rows, deflated as tets are added
  Eigen::MatrixXd residual_;             // S" x h, weighted, deflated likewise
  Eigen::MatrixXd target_;               // S x h, weighted: q - B^T W z
  Eigen::MatrixXd features_;             // S x 9T, weighted
  Eigen::MatrixXd gram_;                 // 9T x 9T, features^T features
  Eigen::MatrixXd cross_;                // 9T x h, features^T target
  Eigen::MatrixXd validation_features_;  // S' x 9T, not weighted
  double noise_floor_ = 0;               // Gram diagonal below which a direction is noise
};

/// r(y) of one tet over many poses: S x 9 of its RS modes (9 x R) and z (R x S), without
/// cancellation.
[[nodiscard]] Eigen::MatrixXd remainder_features(const Eigen::MatrixXd& rs_modes,
                                                 const Eigen::MatrixXd& z);

}  // namespace limber::reduced
