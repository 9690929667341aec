#include "engine/rods/equilibrium/rest_length_solve.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/linkage/linkage_derivatives.h"
#include "tests/engine/rods/linkage/small_linkages.h"
#include "tests/engine/rods/linkage/state_charts.h"

namespace limber::rods {
namespace {

using namespace testing;

/// Largest derivative by what is free to move, beside the largest by what is not.
double imbalance(const LinkageModel& model, const LinkageState& state) {
  LinkageDerivatives derivatives(model);
  Eigen::VectorXd free = derivatives.gradient({state}).unknowns;
  const double reactions = free.cwiseAbs().maxCoeff();
  for (int j = 0; j < model.variables().joints(); ++j)
    free.segment<3>(model.variables().joint_begin(j)).setZero();
  for (int s = 0; s < model.variables().segments(); ++s) {
    const auto& joints = model.graph().segments[s].joints;
    if (joints[0] < 0) free.segment<3>(model.variables().position(s, 0)).setZero();
    if (joints[1] < 0)
      free.segment<3>(model.variables().position(s, model.variables().edges(s))).setZero();
  }
  return free.cwiseAbs().maxCoeff() / reactions;
}

TEST(RestLengthSolve, FindsTheDrawnLengthsOfStraightRodsFromWrongOnes) {
  LinkageModel model = grid_model(4, 3, 1.0);
  const Eigen::VectorXd drawn = model.segment_lengths();
  Random random(4);
  Eigen::VectorXd wrong = drawn;
  for (double& length : wrong) length *= random.uniform(0.98, 1.02);
  model.set_segment_lengths(wrong);
  LinkageState state(model);
  const RestLengthReport report = solve_rest_lengths(model, state);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_LT(report.iterations, 10);
  EXPECT_GT(report.before.total(), 1);
  EXPECT_LT(report.energies.total(), 1e-18 * report.before.total());
  EXPECT_LT((model.segment_lengths() - drawn).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_TRUE(report.at_bound.empty());
}

TEST(RestLengthSolve, LeavesACurvedLinkageWithTheLeastEnergyAtItsJoints) {
  LinkageModel model = curved_model();
  LinkageState state(model);
  const LinkageState start = state;
  const RestLengthReport report = solve_rest_lengths(model, state);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_LT(report.energies.total(), report.before.total());
  for (std::size_t j = 0; j < start.joints().size(); ++j)
    EXPECT_EQ(state.joints()[j].position, start.joints()[j].position);
  EXPECT_LT(imbalance(model, state), 1e-6);
  LinkageDerivatives derivatives(model);
  const LinkageVector here = derivatives.gradient({state});
  EXPECT_LT(here.lengths.cwiseAbs().maxCoeff(), 1e-6 * here.unknowns.cwiseAbs().maxCoeff());
  // Other lengths cost more, however the joints are held to their places.
  Conditions held;
  for (const JointState<double>& joint : start.joints()) {
    held.springs.push_back(
        {JointPoint{static_cast<int>(held.springs.size())}, joint.position, 1e3});
  }
  const auto cost = [&](const Eigen::VectorXd& lengths) {
    LinkageModel other = model;
    other.set_segment_lengths(lengths);
    LinkageState shape = state;
    const EquilibriumReport found = LinkageEquilibrium(other).solve(shape, held);
    EXPECT_TRUE(found.converged()) << found.message;
    return found.potential();
  };
  const Eigen::VectorXd best = model.segment_lengths();
  const double least = cost(best);
  Random random(9);
  for (int k = 0; k < 4; ++k)
    EXPECT_GT(cost(best + random_increment(best.size(), 0.05, random)), least);
  EXPECT_GT(cost(drawn_lengths(model.graph())), least);
}

TEST(RestLengthSolve, StopsAtBoundsWithForcesThatPushAgainstThem) {
  LinkageModel model = grid_model(3, 3, 1.0);
  LinkageState state(model);
  // One direction of the grid is drawn out by 5 %, the other as it was.
  Eigen::VectorXd step = Eigen::VectorXd::Zero(model.variables().size());
  for (int s = 0; s < model.variables().segments(); ++s) {
    for (int i = 0; i <= model.variables().edges(s); ++i) {
      const int at = model.variables().position(s, i);
      if (at >= 0) step[at] = 0.05 * state.vertex(model, s, i).x();
    }
  }
  for (int j = 0; j < model.variables().joints(); ++j)
    step[model.variables().joint_begin(j)] = 0.05 * state.joints()[j].position.x();
  state = state.moved(model, step);
  RestLengthOptions options;
  options.longest = 1.03;
  const RestLengthReport report = solve_rest_lengths(model, state, options);
  EXPECT_TRUE(report.converged()) << report.message;
  const Eigen::VectorXd drawn = drawn_lengths(model.graph());
  const Eigen::VectorXd by_length = LinkageDerivatives(model).gradient({state}).lengths;
  int at_bound = 0;
  for (int s = 0; s < drawn.size(); ++s) {
    const bool bound =
        std::find(report.at_bound.begin(), report.at_bound.end(), s) != report.at_bound.end();
    EXPECT_LE(model.segment_lengths()[s], 1.03 * drawn[s] * (1 + 1e-14));
    if (bound) {
      ++at_bound;
      EXPECT_NEAR(model.segment_lengths()[s], 1.03 * drawn[s], 1e-12 * drawn[s]);
      EXPECT_LT(by_length[s], -1e-3 * kStrip.stretching);  // would continue
    } else {
      EXPECT_LT(std::abs(by_length[s]), 1e-7 * kStrip.stretching);
    }
  }
  EXPECT_EQ(at_bound, 6);  // the rods along x
}

TEST(RestLengthSolve, TakesFreeEndsAndLoneRods) {
  LinkageModel model(build_linkage_graph(mixed_mesh()), 5, {50, 2.0, 0.7, 0.9});
  LinkageState state(model);
  model.set_segment_lengths(1.01 * model.segment_lengths());
  const RestLengthReport report = solve_rest_lengths(model, state);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_LT(report.energies.total(), 1e-15);
  EXPECT_LT((model.segment_lengths() - drawn_lengths(model.graph())).norm(), 1e-6);
}

TEST(RestLengthSolve, RefusesBadOptionsAndLengthsOutOfBounds) {
  LinkageModel model = grid_model(3, 3, 1.0);
  LinkageState state(model);
  const auto field = [&](const RestLengthOptions& options) {
    try {
      (void)solve_rest_lengths(model, state, options);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      return error.field();
    }
    return std::string("accepted");
  };
  EXPECT_EQ(field({0}), "max_iterations");
  EXPECT_EQ(field({10, 2}), "tolerance");
  EXPECT_EQ(field({10, 1e-8, 1.5}), "shortest");
  EXPECT_EQ(field({10, 1e-8, 0.5, 0.9}), "longest");
  model.set_segment_lengths(1.2 * model.segment_lengths());
  EXPECT_EQ(field({10, 1e-8, 0.5, 1.1}), "lengths[0]");
}

TEST(RestLengthSolve, StopsWhenCancelledOrOutOfSteps) {
  LinkageModel model = curved_model();
  LinkageState state(model);
  JobContext context;
  context.cancellation.request();
  EXPECT_EQ(solve_rest_lengths(model, state, {}, context).status, RestLengthStatus::kCancelled);
  // Before the second step: what the first has reached stays.
  JobContext later;
  later.progress = [&](const std::string&, double) { later.cancellation.request(); };
  LinkageModel other = curved_model();
  LinkageState shape(other);
  const RestLengthReport stopped = solve_rest_lengths(other, shape, {}, later);
  EXPECT_EQ(stopped.status, RestLengthStatus::kCancelled);
  EXPECT_EQ(stopped.iterations, 1);
  RestLengthOptions options;
  options.max_iterations = 1;
  const RestLengthReport report = solve_rest_lengths(model, state, options);
  EXPECT_EQ(report.status, RestLengthStatus::kIterationLimit);
  EXPECT_EQ(report.iterations, 1);
  EXPECT_LT(report.energies.total(), report.before.total());
  EXPECT_EQ(stopped.energies.total(), report.energies.total());
}

/// linkages.json, runs burd and darth_vader_pavilion: energies after the solve, of the equilibrium
/// with one joint's position and rotation held.
struct KnownSolve {
  const char* file;
  RodStiffness stiffness;
  int held;
  double closed;
};

class RestLengthReference : public ::testing::TestWithParam<KnownSolve> {};

TEST_P(RestLengthReference, ClosesAsThePublicCode) {
  const KnownSolve& known = GetParam();
  const auto path = linkage_file(known.file);
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no data";
  LinkageModel model(build_linkage_graph(scene::read_line_mesh_file(path)), 10, known.stiffness,
                     BendingForm::kMaterialFrames);
  LinkageState state(model);
  const RestLengthReport report = solve_rest_lengths(model, state);
  EXPECT_TRUE(report.converged()) << report.message;
  EXPECT_LE(report.iterations, 8);
  Conditions conditions;
  conditions.pins = {{known.held}};
  const EquilibriumReport closed = LinkageEquilibrium(model).solve(state, conditions);
  EXPECT_TRUE(closed.converged());
  EXPECT_NEAR(closed.energies.total(), known.closed, 1e-8 * known.closed);
}

INSTANTIATE_TEST_SUITE_P(Known, RestLengthReference,
                         ::testing::Values(KnownSolve{"burd_flat_opt_scaled",
                                                      {6750, 5062.5, 316.40625, 386.3121963558732},
                                                      20,
                                                      0.06516696420644945},
                                           KnownSolve{
                                               "darth_vader_pavilion",
                                               {2340000, 32955000, 15795000, 13920760.49380036},
                                               18,
                                               21314.890648254794}));

}  // namespace
}  // namespace limber::rods
