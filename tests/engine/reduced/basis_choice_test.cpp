#include "engine/reduced/basis_choice.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/random.h"
#include "tests/engine/reduced/basis_checks.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

using testing::left_over;
using testing::modes_of;

ModelOptions options_of(BasisKind kind, int basis_size) {
  ModelOptions options;
  options.mode_count = 8;
  options.basis_size = basis_size;
  options.cubature_size = 6;
  options.training_poses = 80;
  options.test_poses = 20;
  options.basis = kind;
  return options;
}

const bodies::ElasticBody& held_block() {
  static const bodies::ElasticBody body = testing::block(7, 2, 2, 0.1, true);
  return body;
}

void expect_second_derivatives(const bodies::ElasticBody& body, const bodies::ModePair& pair) {
  const ScaledModes modes = modes_of(body);
  const FullReconstruction full(body);
  const Eigen::VectorXd a = modes.modes.col(pair.first), b = modes.modes.col(pair.second);
  const double h = 1e-3;
  Eigen::MatrixXd v(a.size(), 4);
  v << h * (a + b), -h * (a - b), h * (a - b), -h * (a + b);
  const Eigen::MatrixXd u = full.from_linear(v);
  const Eigen::VectorXd expected = (u.col(0) - u.col(1) - u.col(2) + u.col(3)) / (4 * h * h);
  const Eigen::MatrixXd value =
      full.second_derivatives(modes.modes, {pair, {pair.second, pair.first}});
  EXPECT_LT((value.col(0) - expected).norm(), 1e-5 * expected.norm());
  EXPECT_LT((value.col(0) - value.col(1)).norm(), 1e-13 * expected.norm());
}

TEST(BasisChoice, SecondDerivativesOfTheReconstruction) {
  expect_second_derivatives(held_block(), {0, 3});
  expect_second_derivatives(held_block(), {2, 2});
  const bodies::ElasticBody free = testing::block(4, 2, 2, 0.1, false);
  expect_second_derivatives(free, {6, 9});
  expect_second_derivatives(free, {4, 8});  // a rotation and a mode
}

TEST(BasisChoice, EveryKindSpansTheLeadingModes) {
  const ScaledModes modes = modes_of(held_block());
  for (const BasisKind kind : {BasisKind::kBest, BasisKind::kSnapshots,
                               BasisKind::kModalDerivatives, BasisKind::kMapDerivatives}) {
    // With room for all modes they are spanned exactly, else the most important ones nearly.
    const ReducedModel ample = build_model(held_block(), options_of(kind, 16));
    EXPECT_LT(left_over(ample.basis, modes.modes), 1e-10) << static_cast<int>(kind);
    const ReducedModel tight = build_model(held_block(), options_of(kind, 10));
    EXPECT_LT(left_over(tight.basis, modes.modes.leftCols(2)), 0.1) << static_cast<int>(kind);
    EXPECT_EQ(10, tight.basis_size());
    const Eigen::MatrixXd gram = tight.basis.transpose() * tight.basis;
    EXPECT_LT((gram - Eigen::MatrixXd::Identity(10, 10)).norm(), 1e-12);
  }
}

TEST(BasisChoice, TheBetterOneWinsAndTheReportSaysWhich) {
  for (const bool held : {true, false}) {
    const bodies::ElasticBody body = testing::block(6, 2, 2, 0.1, held);
    const int size = held ? 18 : 30;
    const ReducedModel snapshots = build_model(body, options_of(BasisKind::kSnapshots, size));
    const ReducedModel derivatives =
        build_model(body, options_of(BasisKind::kMapDerivatives, size));
    const ReducedModel best = build_model(body, options_of(BasisKind::kBest, size));
    EXPECT_EQ(BasisKind::kSnapshots, snapshots.report.basis);
    EXPECT_EQ(BasisKind::kMapDerivatives, derivatives.report.basis);
    EXPECT_FALSE(snapshots.report.derivative_basis_error.has_value());
    EXPECT_FALSE(derivatives.report.snapshot_basis_error.has_value());
    EXPECT_EQ(size, best.report.compared_size);
    ASSERT_TRUE(best.report.snapshot_basis_error && best.report.derivative_basis_error);
    EXPECT_EQ(*snapshots.report.snapshot_basis_error, *best.report.snapshot_basis_error);
    EXPECT_EQ(*derivatives.report.derivative_basis_error, *best.report.derivative_basis_error);
    const bool derived = *best.report.derivative_basis_error < *best.report.snapshot_basis_error;
    EXPECT_EQ(derived ? BasisKind::kMapDerivatives : BasisKind::kSnapshots, best.report.basis);
    EXPECT_EQ(derived ? derivatives.basis : snapshots.basis, best.basis);
    // Both are good bases: they differ by little.
    EXPECT_LT(*best.report.derivative_basis_error, 1.5 * *best.report.snapshot_basis_error);
    EXPECT_LT(*best.report.snapshot_basis_error, 1.5 * *best.report.derivative_basis_error);
  }
}

TEST(BasisChoice, DerivativesOfStvkFollowWhatModesAloneMiss) {
  const ModelOptions options = options_of(BasisKind::kModalDerivatives, 24);
  const ReducedModel model = build_model(held_block(), options);
  const FullReconstruction full(held_block());
  Random random(9);
  Eigen::MatrixXd z(8, 20);
  for (double& value : z.reshaped()) value = 0.1 * random.normal();
  const Eigen::MatrixXd v = model.modes * z, u = full.from_linear(v);
  Eigen::MatrixXd modes = model.modes;
  for (int k = 0; k < modes.cols(); ++k) {
    for (int j = 0; j < k; ++j) modes.col(k) -= modes.col(j).dot(modes.col(k)) * modes.col(j);
    modes.col(k).normalize();
  }
  EXPECT_LT(left_over(model.basis, u), 0.35 * left_over(modes, u));
}

TEST(BasisChoice, AnInputAnimationEnrichesEveryKind) {
  const bodies::ElasticBody& body = held_block();
  // Longitudinal waves far above the modes, zero at the fixed end.
  Eigen::MatrixXd animation(3 * body.mesh.node_count(), 12);
  for (int frame = 0; frame < animation.cols(); ++frame) {
    for (int node = 0; node < body.mesh.node_count(); ++node) {
      const double x = body.mesh.nodes(0, node);
      animation.col(frame).segment<3>(3 * node) =
          0.02 * std::sin(0.5 * frame) * Eigen::Vector3d(std::sin(18 * x), 0, std::sin(31 * x));
    }
  }
  const Eigen::MatrixXd frames = animation.rightCols(11);  // the first one is the rest shape
  for (const BasisKind kind : {BasisKind::kBest, BasisKind::kSnapshots,
                               BasisKind::kModalDerivatives, BasisKind::kMapDerivatives}) {
    const ModelOptions options = options_of(kind, 20);
    const double without = left_over(build_model(body, options).basis, frames);
    const double with = left_over(build_model(body, options, {}, animation).basis, frames);
    EXPECT_LT(with, 0.05) << static_cast<int>(kind);
    EXPECT_GT(without, 0.3) << static_cast<int>(kind);
  }
}

}  // namespace
}  // namespace limber::reduced
