#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/base/job.h"
#include "engine/base/random.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/reduced/pose_data.h"

namespace limber::reduced {

/// The paper's cubature (space-time editing, section 3.2; An et al. 2008), the baseline of the
/// fitted maps.
///   q = sum over tets of w_e P_e g_e,  w_e >= 0,  P = (B^T A B)^-1 B^T G^T V.
/// Tets are added one by one from random candidates, with weights by non-negative least squares on
/// relative errors (eq. 15).
class WeightedCubature {
 public:
  /// @param basis       B, 3n x h; a free body's first three columns span the translations
  /// @param node_share  n, shares of the mass that sum to one for a free body (whose translation it
  /// fixes); else empty
  /// @param train       poses weights are fitted to
  WeightedCubature(const bodies::GradientOperator& gradient, const Eigen::MatrixXd& modes,
                   const Eigen::MatrixXd& basis, const Eigen::VectorXd& node_share,
                   const PoseData& train, std::uint64_t seed);

  /// Adds the best of some random candidates and solves for all weights. False when every tet has
  /// been looked at.
  bool add_tet(const JobContext& job);

  /// Tets with a weight that counts.
  [[nodiscard]] std::vector<int> tets() const;
  /// w_e P_e of those tets, h x 9T.
  [[nodiscard]] Eigen::MatrixXd map() const;

 private:
  [[nodiscard]] Eigen::MatrixXd projection(int tet) const;  // P_e, h x 9
  [[nodiscard]] Eigen::VectorXd column(int tet) const;      // P_e g_e of all poses, relative, h S

  const bodies::GradientOperator& gradient_;
  const Eigen::MatrixXd& modes_;
  const Eigen::MatrixXd& basis_;
  const PoseData& train_;
  Random random_;
  Eigen::MatrixXd solve_;     // h x h: (B^T A B)^-1, with the translation of a free body
  std::vector<int> unused_;   // tets not tried as members yet
  std::vector<int> members_;  // chosen tets, some with weight zero
  Eigen::MatrixXd columns_;   // h S x members
  Eigen::MatrixXd gram_;      // members x members
  Eigen::VectorXd rhs_;       // members
  Eigen::VectorXd target_;    // h S
  Eigen::VectorXd residual_;  // h S
  Eigen::VectorXd weights_;   // members
};

}  // namespace limber::reduced
