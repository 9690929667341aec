#include "engine/rods/linkage/edge_tensions.h"

#include <gtest/gtest.h>

#include "engine/base/random.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/linkage/mixed_linkage.h"

namespace limber::rods {
namespace {

using testing::kStiffness;

class EdgeTensionsTest : public ::testing::Test {
 protected:
  EdgeTensionsTest()
      : model_(build_linkage_graph(testing::mixed_mesh()), 6, kStiffness),
        assembly_(model_),
        state_(model_) {
    state_ = state_.moved(model_, step(0.06));
  }
  Eigen::VectorXd step(double amount) {
    return Eigen::VectorXd::NullaryExpr(model_.variables().size(),
                                        [&] { return random_.uniform(-amount, amount); });
  }
  /// What an edge of a segment carries in a shape.
  double carried(const LinkageState& state, int segment, int edge) const {
    const ChainBatches::Place place = model_.chains()->place(segment);
    const double* const slot =
        model_.slot_parameters(place.batch) + edge * LinkageModel::kFields * kChainLanes;
    const double rest = slot[LinkageModel::kRestLength * kChainLanes + place.lane];
    const double stretching = slot[LinkageModel::kStretching * kChainLanes + place.lane];
    const double length =
        (state.vertex(model_, segment, edge + 1) - state.vertex(model_, segment, edge)).norm();
    return stretching * (length / rest - 1);
  }
  double expected(const EdgeTensions& tensions, int segment, int edge) const {
    const ChainBatches::Place place = model_.chains()->place(segment);
    return tensions.of(model_, place.batch)[edge * kChainLanes + place.lane];
  }

  Random random_{3};
  LinkageModel model_;
  LinkageAssembly assembly_;
  LinkageState state_;
};

TEST_F(EdgeTensionsTest, GrowByTheirRatesAlongAStep) {
  const Eigen::VectorXd v = step(0.3);
  EdgeTensions tensions(model_);
  tensions.expect(model_, state_, v);
  constexpr double kSmall = 1e-4;
  const LinkageState ahead = state_.moved(model_, kSmall * v);
  const LinkageState behind = state_.moved(model_, -kSmall * v);
  for (int s = 0; s < model_.variables().segments(); ++s) {
    for (int e = 0; e < model_.variables().edges(s); ++e) {
      const double rate = (carried(ahead, s, e) - carried(behind, s, e)) / (2 * kSmall);
      EXPECT_NEAR(expected(tensions, s, e), carried(state_, s, e) + rate, 2e-3)
          << "segment " << s << ", edge " << e;
    }
  }
}

TEST_F(EdgeTensionsTest, OfTheShapeItselfGiveItsHessian) {
  EdgeTensions tensions(model_);
  tensions.expect(model_, state_, Eigen::VectorXd::Zero(model_.variables().size()));
  CondensedMatrix with(model_.chains()), without(model_.chains());
  Eigen::VectorXd gradient(model_.variables().size()), own(gradient.size());
  const double energy = assembly_.hessian(state_, own, without).total();
  EXPECT_DOUBLE_EQ(assembly_.hessian(state_, gradient, with, tensions).total(), energy);
  EXPECT_LT((gradient - own).norm(), 1e-12 * own.norm());
  const Eigen::VectorXd x = step(1);
  Eigen::VectorXd a(x.size()), b(x.size());
  with.multiply(x, a);
  without.multiply(x, b);
  EXPECT_LT((a - b).norm(), 1e-12 * b.norm());
}

TEST_F(EdgeTensionsTest, OthersGiveTheHessianOfOtherForces) {
  EdgeTensions tensions(model_);
  tensions.expect(model_, state_, step(0.3));
  CondensedMatrix with(model_.chains());
  Eigen::VectorXd gradient(model_.variables().size()), own(gradient.size());
  (void)assembly_.gradient(state_, own);
  (void)assembly_.hessian(state_, gradient, with, tensions);
  EXPECT_GT((gradient - own).norm(), 0.1 * own.norm());
}

}  // namespace
}  // namespace limber::rods
