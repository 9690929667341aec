#include "engine/rods/linkage/size_derivatives.h"

#include <gtest/gtest.h>

#include "engine/base/parallel.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/linkage/mixed_linkage.h"
#include "tests/engine/rods/linkage/state_charts.h"

namespace limber::rods {
namespace {

using namespace testing;

/// A bent linkage with joints of all valences and free ends, sizes of its own.
class SizeDerivativesTest : public ::testing::TestWithParam<std::tuple<BendingForm, int>> {
 protected:
  SizeDerivativesTest()
      : model_(build_linkage_graph(mixed_mesh()), std::get<1>(GetParam()), kStiffness,
               std::get<0>(GetParam())),
        state_(model_) {
    Random random(22);
    Eigen::VectorXd edges = model_.edge_lengths();
    for (double& edge : edges) edge *= random.uniform(0.9, 1.1);
    model_.set_edge_lengths(edges);
    Eigen::VectorXd sections(model_.variables().segments());
    for (double& section : sections) section = random.uniform(0.8, 1.25);
    model_.set_section_scales(sections);
    for (int k = 0; k < 3; ++k)
      state_ = state_.moved(model_, random_increment(model_.variables().size(), 0.05, random));
    v_ = random_increment(model_.variables().size(), 1, random);
  }
  LinkageModel model_;
  LinkageState state_;
  Eigen::VectorXd v_;
};

TEST_P(SizeDerivativesTest, AreThoseOfDualNumbers) {
  SizeDerivatives sizes(model_);
  LinkageDerivatives derivatives(model_);
  const LinkageVector gradient = derivatives.gradient({state_});
  const LinkageVector mixed = derivatives.second({state_}, {v_, {}});
  const auto expect = [&](double share, double along) {
    const LinkageVector& result = sizes.evaluate(state_, share, along * v_);
    const auto near = [&](const Eigen::VectorXd& own, const Eigen::VectorXd& first,
                          const Eigen::VectorXd& second) {
      const Eigen::VectorXd expected = share * first + along * second;
      EXPECT_LT((own - expected).norm(), 1e-12 * expected.norm()) << share << " " << along;
      EXPECT_GT(expected.norm(), 0);
    };
    near(result.lengths, gradient.lengths, mixed.lengths);
    near(result.edges, gradient.edges, mixed.edges);
    near(result.sections, gradient.sections, mixed.sections);
  };
  expect(1, 0);
  expect(0, 1);
  expect(0.3, -0.7);
}

TEST_P(SizeDerivativesTest, OfAShapeThatStaysAreTheGradient) {
  SizeDerivatives sizes(model_);
  const LinkageVector gradient = LinkageDerivatives(model_).gradient({state_});
  const LinkageVector& result = sizes.evaluate(state_, -0.4);
  const auto near = [](const Eigen::VectorXd& own, const Eigen::VectorXd& expected) {
    EXPECT_LT((own + 0.4 * expected).norm(), 1e-12 * expected.norm());
  };
  near(result.lengths, gradient.lengths);
  near(result.edges, gradient.edges);
  near(result.sections, gradient.sections);
}

TEST_P(SizeDerivativesTest, ForcesChangeAsDualNumbersSay) {
  LinkageAssembly assembly(model_);
  LinkageDerivatives derivatives(model_);
  Random random(23);
  const int segments = model_.variables().segments();
  const Eigen::VectorXd lengths = random_increment(segments, 1, random);
  const Eigen::VectorXd edges = random_increment(model_.edge_numbers().size(), 0.3, random);
  const Eigen::VectorXd sections = random_increment(segments, 1, random);
  for (const LinkageVector& v :
       {LinkageVector{{}, lengths}, LinkageVector{{}, {}, edges},
        LinkageVector{{}, {}, {}, sections}, LinkageVector{{}, lengths, edges, sections}}) {
    const Eigen::VectorXd expected = derivatives.second({state_}, v).unknowns;
    Eigen::VectorXd change(expected.size());
    assembly.gradient_change(state_, v, change);
    EXPECT_LT((change - expected).norm(), 1e-12 * expected.norm());
    EXPECT_GT(expected.norm(), 0);
  }
}

TEST_P(SizeDerivativesTest, DoNotDependOnThreads) {
  SizeDerivatives sizes(model_);
  const int before = thread_count();
  set_thread_count(1);
  const Eigen::VectorXd alone = sizes.evaluate(state_, 0.5, v_).lengths;
  set_thread_count(3);
  EXPECT_EQ(sizes.evaluate(state_, 0.5, v_).lengths, alone);
  set_thread_count(before);
}

INSTANTIATE_TEST_SUITE_P(Forms, SizeDerivativesTest,
                         ::testing::Combine(::testing::Values(BendingForm::kMaterialFrames,
                                                              BendingForm::kAveragedFrames,
                                                              BendingForm::kTurningAngle),
                                            ::testing::Values(3, 5)));

}  // namespace
}  // namespace limber::rods
