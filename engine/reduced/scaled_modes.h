#pragma once

#include <Eigen/Core>

#include "engine/bodies/elastic_body.h"
#include "engine/bodies/modal_analysis.h"

namespace limber::reduced {

/// W-hat and its eigenvalues, scaled as ReducedModel documents.
struct ScaledModes {
  Eigen::VectorXd eigenvalues;  // R [1/s^2]
  Eigen::MatrixXd modes;        // 3n x R [m]
  int rigid_count = 0;          // 0 or 6
  int mechanism_count = 0;      // of the elastic modes the first ones (bodies::ModalBasis)

  [[nodiscard]] int count() const { return static_cast<int>(eigenvalues.size()); }
  [[nodiscard]] int elastic_count() const { return count() - rigid_count; }
};

/// Place of lambda_1, the eigenvalue that scales and periods refer to: the first one that is
/// neither rigid nor of a mechanism, whose eigenvalue is made up. Bodies with only mechanisms: the
/// first mechanism.
/// @param count  rigid, mechanism and other modes together, > rigid_count
[[nodiscard]] constexpr int reference_mode(int count, int rigid_count, int mechanism_count) {
  const int first = rigid_count + mechanism_count;
  return first < count ? first : rigid_count;
}

/// Elastic columns: the mode times c / sqrt(lambda_k / lambda_1), c such that the column of
/// lambda_1 moves its farthest node by one body length. Mechanisms: the mode times c. Rigid
/// columns: x, y, z by one body length each, then e_k x (X - centre of mass) per radian.
[[nodiscard]] ScaledModes scale_modes(const bodies::ElasticBody& body,
                                      const bodies::ModalBasis& basis);

/// Fields that span the rigid motions of a free body, 3n x 12 [m]: x, y, z by one metre, then
/// X (x - centre of mass) for X = e_i e_j^T, column 3 + 3 j + i.
[[nodiscard]] Eigen::MatrixXd affine_fields(const bodies::ElasticBody& body);

/// Largest displacement of a node in each column of u (3n x k) [m].
[[nodiscard]] Eigen::VectorXd largest_node_displacement(const Eigen::Ref<const Eigen::MatrixXd>& u);

}  // namespace limber::reduced
