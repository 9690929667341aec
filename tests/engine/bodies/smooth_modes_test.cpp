#include "engine/bodies/smooth_modes.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/bodies/mass.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::bodies {
namespace {

Eigen::MatrixXd gram_of_modes(const ElasticBody& body, const ModalBasis& basis) {
  const Eigen::VectorXd node_mass = lumped_node_mass(body.mesh);
  Eigen::VectorXd mass(3 * node_mass.size());
  for (Eigen::Index i = 0; i < node_mass.size(); ++i)
    mass.segment<3>(3 * i).setConstant(node_mass[i]);
  const Eigen::MatrixXd elastic = basis.modes.rightCols(basis.modes.cols() - basis.rigid_count);
  return elastic.transpose() * mass.asDiagonal() * elastic;
}

TEST(SmoothModes, FrequenciesOfBarsAreNearTheirs) {
  for (const bool is_held : {true, false}) {
    const ElasticBody body = reduced::testing::block(24, 6, 6, 0.1, is_held);
    const ModalBasis smooth = smooth_modes(body, {});
    const ModalBasis exact = modal_analysis(body, {.mode_count = 10});
    ASSERT_EQ(smooth.rigid_count, exact.rigid_count);
    ASSERT_EQ(smooth.modes.cols(), exact.modes.cols());
    for (int k = exact.rigid_count; k < exact.modes.cols(); ++k) {
      const double ratio = std::sqrt(smooth.eigenvalues[k] / exact.eigenvalues[k]);
      // Lumped masses are a little slower than consistent ones.
      EXPECT_GT(ratio, 0.9) << is_held << " " << k;
      EXPECT_LT(ratio, 1.2) << is_held << " " << k;
    }
    const Eigen::MatrixXd gram = gram_of_modes(body, smooth);
    EXPECT_LT((gram - Eigen::MatrixXd::Identity(gram.rows(), gram.cols())).norm(), 1e-6);
    for (const int node : body.fixed_nodes)
      EXPECT_EQ(smooth.modes.middleRows(3 * node, 3).norm(), 0);
  }
}

TEST(SmoothModes, OptionsAreNamed) {
  const ElasticBody body = reduced::testing::block(2, 1, 1, 0.1, true);
  EXPECT_THROW((void)smooth_modes(body, {.mode_count = 0}), Error);
  EXPECT_THROW((void)smooth_modes(body, {.function_count = 0}), Error);
}

}  // namespace
}  // namespace limber::bodies
