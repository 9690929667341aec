// Problems with several minima: which one a session shows is no accident.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/scene/samples/samples.h"
#include "engine/session/bodies/start_search.h"
#include "tests/engine/session/bodies/session_support.h"
#include "tests/support/published.h"

namespace limber::session {
namespace {

using spacetime::SolveStatus;
using test::held;
using test::Live;

/// The sample bird: its first answer is not the lowest there is, and an edit there and back finds
/// another.
constexpr int kPulledNode = 961, kPulledFrame = 60;
const Eigen::Vector3d kPull = {0, 0, 0.1};

/// In the published form, which has more optima.
scene::Scene bird() {
  scene::Scene scene = scene::make_sample("bird");
  scene.dynamics = testing::published_dynamics(scene.dynamics.period_frames);
  return scene;
}

double distance(const BodyResult& a, const BodyResult& b) {
  return (a.coordinates - b.coordinates).norm() / b.coordinates.norm();
}

TEST(SessionMinima, UndoAndRedoBringBackTheMotionThatWasThere) {
  Live live(bird());
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  ASSERT_EQ(first->report.status, SolveStatus::kConverged);
  for (int i = 0; i < 3; ++i) {
    const auto added = live.edit({AddConstraint{held(kPulledFrame, kPulledNode, kPull)}});
    ASSERT_TRUE(added);
    EXPECT_GT(distance(*added, *first), 0.01);
    const auto undone = live.edit({Undo{}});
    ASSERT_TRUE(undone);
    EXPECT_EQ(undone->report.status, SolveStatus::kConverged);
    EXPECT_NEAR(undone->report.total_energy, first->report.total_energy,
                1e-9 * first->report.total_energy);
    EXPECT_LT(distance(*undone, *first), 1e-4);
    const auto redone = live.edit({Redo{}, Undo{}, Redo{}});
    ASSERT_TRUE(redone);
    EXPECT_LT(distance(*redone, *added), 1e-4);
    ASSERT_TRUE(live.edit({Undo{}}));
  }
}

TEST(SessionMinima, AColdSolveThatEndsHigherReplacesNothing) {
  Live live(bird());
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const auto added = live.edit({AddConstraint{held(kPulledFrame, kPulledNode, kPull)}});
  ASSERT_TRUE(added);
  // Not an undo: that would come back to the first answer.
  const auto revision =
      live.session.edit({RemoveConstraint{live.session.constraints().back().id}}).revision;
  const auto lower = live.recorder->wait_final(revision);
  ASSERT_TRUE(lower);
  ASSERT_LT(lower->report.total_energy, 0.9 * first->report.total_energy);
  live.session.solve_cold(3);
  const auto cold = live.recorder->wait_final(revision, lower->sequence);
  ASSERT_TRUE(cold);
  EXPECT_EQ(cold->cold_request, 3u);
  EXPECT_EQ(cold->report.total_energy, lower->report.total_energy);
  EXPECT_NE(cold->report.message.find("cold solve"), std::string::npos) << cold->report.message;
  EXPECT_LT(distance(*cold, *lower), 1e-12);
}

/// The final result with which the comparison of starts ends.
std::shared_ptr<const BodyResult> wait_compared(Live& live, Revision revision) {
  auto result = live.recorder->wait_final(revision);
  while (result && !result->starts) result = live.recorder->wait_final(revision, result->sequence);
  return result;
}

TEST(SessionMinima, FurtherStartsFindTheLowerOptimumWithoutEdits) {
  Live alone(bird());
  const auto first = alone.recorder->wait_final(0);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->starts);
  SessionOptions options;
  options.start_search = StartSearchOptions{};
  options.start_search->least_reach = 0;
  std::vector<double> energies;
  for (int run = 0; run < 2; ++run) {
    Live live(bird(), options);
    const auto compared = wait_compared(live, 0);
    ASSERT_TRUE(compared);
    EXPECT_EQ(compared->report.status, SolveStatus::kConverged);
    EXPECT_GT(compared->starts->compared, 3);
    EXPECT_EQ(compared->starts->budget, 7);
    EXPECT_GE(compared->starts->optima, 2);
    EXPECT_GT(compared->starts->largest_distance, 0);
    EXPECT_LE(compared->starts->lowest_energy, first->report.total_energy);
    EXPECT_NEAR(compared->report.total_energy, compared->starts->lowest_energy,
                1e-3 * compared->starts->lowest_energy);
    EXPECT_THAT(compared->report.message, ::testing::HasSubstr("different optima"));
    energies.push_back(compared->report.total_energy);
  }
  EXPECT_LT(energies[0], 0.9 * first->report.total_energy);
  EXPECT_NEAR(energies[0], energies[1], 1e-9 * energies[0]) << "the same in every session";
}

/// The nodes that lie farthest out, each far from those before it.
std::vector<int> ends_of_limbs(const scene::Scene& scene, int count) {
  const Eigen::Matrix3Xd& nodes = scene.mesh.nodes;
  Eigen::VectorXd away =
      Eigen::VectorXd::Constant(nodes.cols(), std::numeric_limits<double>::infinity());
  for (const int node : scene.fixed_nodes)
    away = away.cwiseMin((nodes.colwise() - nodes.col(node)).colwise().norm().transpose());
  std::vector<int> ends;
  for (int i = 0; i < count; ++i) {
    Eigen::Index next = 0;
    away.maxCoeff(&next);
    ends.push_back(static_cast<int>(next));
    away = away.cwiseMin((nodes.colwise() - nodes.col(next)).colwise().norm().transpose());
  }
  return ends;
}

// What is shown in the end does not depend on luck: no order of edits ends lower.
TEST(SessionMinima, OfFourFarTargetsTheShownMotionIsNotAboveThoseOfSeveralOrdersOfEdits) {
  scene::Scene scene = scene::make_sample("bird");
  scene.constraints.clear();
  const double length =
      (scene.mesh.nodes.rowwise().maxCoeff() - scene.mesh.nodes.rowwise().minCoeff()).norm();
  constexpr double kShare = 0.25;  // of the diagonal
  const std::vector<int> ends = ends_of_limbs(scene, 4);
  std::vector<scene::Constraint> targets;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    auto target = held(30 + 20 * static_cast<int>(i), ends[i],
                       kShare * length * Eigen::Vector3d(0.3 * side, 0.5, 0.8 * side).normalized());
    target.weight = test::kInfinity;
    targets.push_back(target);
  }
  SessionOptions options;
  options.start_search = StartSearchOptions{};
  scene::Scene whole = scene;
  whole.constraints = targets;
  Live live(whole, options);
  const auto shown = wait_compared(live, 0);
  ASSERT_TRUE(shown && shown->starts);
  EXPECT_GE(shown->starts->compared, 5);
  for (const auto& order : {std::vector<int>{0, 1, 2, 3}, {3, 2, 1, 0}}) {
    Live edited(scene);
    std::shared_ptr<const BodyResult> last;
    for (const int i : order)
      last = edited.edit({AddConstraint{targets[static_cast<std::size_t>(i)]}});
    ASSERT_TRUE(last);
    EXPECT_LE(shown->report.total_energy, 1.001 * last->report.total_energy);
  }
}

TEST(SessionMinima, StartsThatAgreeAreCountedAndChangeNothing) {
  SessionOptions options;
  options.start_search = StartSearchOptions{};
  options.start_search->least_reach = 0;
  Live live(test::bent_bar(), options);
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const auto compared = wait_compared(live, 0);
  ASSERT_TRUE(compared);
  EXPECT_EQ(compared->starts->optima, 1);
  EXPECT_EQ(compared->starts->compared, compared->starts->budget);
  EXPECT_EQ(compared->report.total_energy, first->report.total_energy);
  EXPECT_LT(compared->starts->largest_distance, 1e-5);
}

TEST(SessionMinima, AnAnswerThatDidNotConvergeIsComparedToo) {
  SessionOptions options;
  options.solver.max_iterations = 4;
  Live alone(bird(), options);
  const auto first = alone.recorder->wait_final(0);
  ASSERT_TRUE(first);
  ASSERT_EQ(first->report.status, SolveStatus::kIterationLimit);
  options.start_search = StartSearchOptions{};
  options.start_search->least_reach = 0;
  Live live(bird(), options);
  const auto compared = wait_compared(live, 0);
  ASSERT_TRUE(compared);
  EXPECT_GT(compared->starts->compared, 3);
  EXPECT_GE(compared->starts->unconverged, 1);
  EXPECT_LE(compared->report.total_energy, first->report.total_energy);
  EXPECT_THAT(compared->report.message, ::testing::HasSubstr("did not converge"));
}

TEST(SessionMinima, StartsAreComparedAnewForAnotherNumberOfConstraints) {
  SessionOptions options;
  options.start_search = StartSearchOptions{};
  options.start_search->least_reach = 0;
  Live live(test::bent_bar(), options);
  const auto first = wait_compared(live, 0);
  ASSERT_TRUE(first);
  const auto moved_by = [&](int frame) -> Eigen::Vector3d {
    return test::tip_at(live.session, *first, frame) - test::tip_at(live.session, *first, 0);
  };
  const std::uint64_t id = live.session.constraints().front().id;
  const auto dragged = live.edit({MoveConstraint{id, Eigen::Vector3d(0, 0.101, 0.05)}});
  ASSERT_TRUE(dragged);
  EXPECT_FALSE(dragged->awaits_starts) << "a drag goes on";
  const auto added = live.edit({AddConstraint{held(15, test::kTip, moved_by(15))}});
  ASSERT_TRUE(added);
  ASSERT_LT((added->modal - first->modal).norm(), 0.5 * first->modal.norm())
      << "else the motion alone would be a reason";
  EXPECT_TRUE(added->awaits_starts);
}

TEST(SessionMinima, TheWorkOfASearchIsBounded) {
  StartSearchOptions options;
  EXPECT_EQ(options.starts_within(4, 129, 2000), 6);
  EXPECT_EQ(options.starts_within(24, 129, 2000), 6);
  EXPECT_EQ(options.starts_within(24, 129, 20'000), 0) << "an order is 24 solves";
  EXPECT_EQ(options.starts_within(4, 129, 20'000), 6);
  EXPECT_EQ(options.starts_within(8, 129, 20'000), 3) << "21 solves: one, and two orders of 8";
  EXPECT_EQ(options.starts_within(24, 5000, 20'000), 0);
  options.most_work = 0;
  EXPECT_EQ(options.starts_within(2, 1, 1), 0);
}

TEST(SessionMinima, SearchesAreMadeOfAsManyStartsAsTheWorkAllows) {
  SessionOptions options;
  options.start_search = StartSearchOptions{};
  options.start_search->least_reach = 0;
  const scene::Scene scene = test::bent_bar();
  const std::int64_t solve = std::int64_t{scene.frame_count} * scene.mesh.tet_count();
  options.start_search->most_work = 5 * solve;  // at once, and two orders of two constraints
  {
    Live live(scene, options);
    const auto compared = wait_compared(live, 0);
    ASSERT_TRUE(compared);
    EXPECT_EQ(compared->starts->budget, 4);
    EXPECT_EQ(compared->starts->compared, 4);
  }
  options.start_search->most_work = 2 * solve;
  Live live(scene, options);
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->awaits_starts);
}

TEST(SessionMinima, OfAnOptimumThatIsNotTakenOverIsNotSaidThatItIsShown) {
  StartComparison comparison;
  comparison.compared = 5;
  comparison.optima = 2;
  using ::testing::HasSubstr;
  EXPECT_THAT(describe_starts(comparison, 1), HasSubstr("the lowest one is shown"));
  comparison.unconverged = 2;
  EXPECT_THAT(describe_starts(comparison, 1), HasSubstr("2 of them did not converge"));
  const std::string before = describe_starts(comparison, 1, ShownStart::kBefore);
  EXPECT_THAT(before, HasSubstr("could not be taken over"));
  EXPECT_THAT(before, ::testing::Not(HasSubstr("the lowest one is shown")));
}

TEST(SessionMinima, SmallMotionsAreNotCompared) {
  SessionOptions options;
  options.start_search = StartSearchOptions{};
  Live live(test::bent_bar(), options);
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->awaits_starts);
}

}  // namespace
}  // namespace limber::session
