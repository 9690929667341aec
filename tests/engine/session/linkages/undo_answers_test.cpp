// What undo and redo give back of a linkage: the very answers that its revisions had.

#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/degrees.h"
#include "engine/session/linkages/equilibrium_cache.h"
#include "engine/session/linkages/live_problem.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using rods::EquilibriumStatus;
using scene::Held;
using testing::hyperboloid;
using testing::LinkageRecorder;
using testing::LiveSession;
using SharedResult = std::shared_ptr<const LinkageResult>;

void expect_the_same(const SharedResult& now, const SharedResult& then, const std::string& what) {
  ASSERT_TRUE(now && then) << what;
  EXPECT_EQ(now->solve_failed, then->solve_failed) << what;
  EXPECT_EQ(now->report.status, then->report.status) << what << ": " << now->report.message;
  EXPECT_EQ(now->report.energies.total(), then->report.energies.total()) << what;
  EXPECT_EQ(now->report.energies.bending, then->report.energies.bending) << what;
  EXPECT_EQ(now->report.potential(), then->report.potential()) << what;
  EXPECT_EQ(now->mean_angle, then->mean_angle) << what;
  EXPECT_TRUE(now->frames->rightCols<1>() == then->frames->rightCols<1>()) << what;
  EXPECT_TRUE(now->strains->rightCols<1>() == then->strains->rightCols<1>()) << what;
}

/// Edits of all kinds, some that undo what others did in part.
std::vector<LinkageEdit> edit_number(int i) {
  scene::JointLoad load;
  load.joint = 30;
  load.force = {0, 0, -0.02 * (i % 5)};
  scene::LinkageTarget target;
  target.id = static_cast<std::uint64_t>(1000 + i);
  target.joint = 5 + i;
  target.position = {0.4, 0.2, 0.01 * i};
  target.stiffness = 5;
  switch (i % 5) {
    case 0:
      return {SetMeanAngle{(24 + i) * kDegree}};
    case 1:
      return {PinJoint{i, Held::kMotion}, SetJointLoad{load}};
    case 2:
      return {AddTarget{target}};
    case 3:
      return {PinJoint{i - 2, std::nullopt}, SetMeanAngle{std::nullopt}};
    default:
      return {SetJointAngle{40, (25 + i) * kDegree}};
  }
}

TEST(UndoAnswers, ThirtyEditsComeBackOneByOneAndAreRedone) {
  constexpr int kEdits = 30;
  scene::Linkage linkage = hyperboloid();
  linkage.conditions.mean_angle = 20 * kDegree;
  LiveSession live(linkage);
  std::vector<SharedResult> answers = {live.recorder->wait_final(0)};
  for (int i = 0; i < kEdits; ++i) answers.push_back(live.edit(edit_number(i)));
  for (int i = kEdits; i-- > 0;)
    expect_the_same(live.edit({Undo{}}), answers[i], "undo to " + std::to_string(i));
  for (int i = 1; i <= kEdits; ++i)
    expect_the_same(live.edit({Redo{}}), answers[i], "redo to " + std::to_string(i));
  for (int i = kEdits; i-- > 0;) live.session.edit({Undo{}});  // those in between are passed over
  const SharedResult back = live.recorder->wait_final(live.session.revision());
  expect_the_same(back, answers[0], "undo of all");
  const auto deployed = live.edit({SetMeanAngle{30 * kDegree}});
  ASSERT_TRUE(deployed);
  EXPECT_EQ(deployed->report.status, EquilibriumStatus::kConverged) << deployed->report.message;
  EXPECT_NEAR(deployed->mean_angle, 30 * kDegree, 1e-9);
}

/// 64 MB of shapes would have been 18 of these.
TEST(UndoAnswers, ThirtyEditsComeBackWithSixtyEdgesASegmentAndTheLinkageDeploysAfterwards) {
  constexpr int kEdits = 30;
  scene::Linkage linkage = hyperboloid();
  linkage.edges_per_segment = 60;
  linkage.conditions.mean_angle = 20 * kDegree;
  LiveSession live(linkage);
  std::vector<SharedResult> answers = {live.recorder->wait_final(0)};
  for (int i = 1; i <= kEdits; ++i)
    answers.push_back(live.edit({SetMeanAngle{(20 + 0.05 * i) * kDegree}}));
  for (int i = kEdits; i-- > 0;)
    expect_the_same(live.edit({Undo{}}), answers[i], "undo to " + std::to_string(i));
  expect_the_same(live.edit({Redo{}}), answers[1], "redo");
  const auto deployed = live.edit({SetMeanAngle{20 * kDegree}});
  ASSERT_TRUE(deployed);
  EXPECT_EQ(deployed->report.status, EquilibriumStatus::kConverged) << deployed->report.message;
  EXPECT_FALSE(deployed->solve_failed);
  EXPECT_NEAR(deployed->mean_angle, 20 * kDegree, 1e-9);
  EXPECT_NEAR(deployed->report.energies.total(), answers[0]->report.energies.total(),
              1e-6 * answers[0]->report.energies.total());
}

TEST(UndoAnswers, AFailedRevisionFailsInTheSameWordsWithTheSameShape) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.recorder->wait_final(0));
  scene::JointLoad load;
  load.joint = 3;
  load.force = {0, 0, 1};
  const auto failed = live.edit({SetJointLoad{load}});  // nothing holds it
  const auto held = live.edit({PinJoint{0, Held::kMotion}});
  ASSERT_TRUE(failed && held);
  ASSERT_TRUE(failed->solve_failed);
  EXPECT_NE(failed->report.message.find("the loads on the linkage have a resultant of 1 N, and no "
                                        "support holds it: pin a joint"),
            std::string::npos)
      << failed->report.message;
  const auto again = live.edit({Undo{}});
  expect_the_same(again, failed, "undo to a failed revision");
  EXPECT_EQ(again->report.message, failed->report.message);
  expect_the_same(live.edit({Redo{}}), held, "redo");
}

TEST(UndoAnswers, SupportsAndLoadsThatGoTogetherDoNotPushTheLinkage) {
  LiveSession live(hyperboloid());
  ASSERT_TRUE(live.recorder->wait_final(0));
  scene::JointLoad load;
  load.joint = 30;
  load.force = {0, 0, -0.2};
  const auto loaded =
      live.edit({PinJoint{0, Held::kMotion}, SetJointLoad{load}, SetGravity{{0, 0, -1}}});
  ASSERT_TRUE(loaded);
  ASSERT_EQ(loaded->report.status, EquilibriumStatus::kConverged) << loaded->report.message;
  load.force.setZero();
  const auto released = live.edit({PinJoint{0, std::nullopt}, SetJointLoad{load},
                                   SetGravity{{0, 0, 0}}, SetMeanAngle{25 * kDegree}});
  ASSERT_TRUE(released);
  EXPECT_EQ(released->report.status, EquilibriumStatus::kConverged) << released->report.message;
  EXPECT_FALSE(released->solve_failed);
}

/// Tasks wait until they are run here, so that edits come sooner than solves.
class Waiting {
 public:
  [[nodiscard]] Executor executor() {
    return [this](std::function<void()> task) { tasks_.push_back(std::move(task)); };
  }
  void run() {
    while (!tasks_.empty()) {
      const std::function<void()> task = std::move(tasks_.front());
      tasks_.pop_front();
      task();
    }
  }

 private:
  std::deque<std::function<void()>> tasks_;
};

TEST(UndoAnswers, ARevisionThatWasPassedOverIsFoundFromTheOneBeforeIt) {
  const auto answer = [](const std::vector<std::vector<int>>& rounds) {
    Waiting waiting;
    const auto recorder = std::make_shared<LinkageRecorder>();
    LinkageSession session("waiting", hyperboloid(), {}, waiting.executor(), recorder);
    waiting.run();
    const std::vector<LinkageEdit> edits[] = {
        {SetMeanAngle{40 * kDegree}},
        {PinJoint{0, Held::kMotionAndAngle}, SetMeanAngle{55 * kDegree}},
        {SetMeanAngle{30 * kDegree}, SetJointAngle{20, 50 * kDegree}}};
    for (const std::vector<int>& round : rounds) {
      for (const int edit : round) {
        if (edit >= 0) {
          session.edit(edits[edit]);
        } else {
          session.edit({edit == -1 ? LinkageEdit(Undo{}) : LinkageEdit(Redo{})});
        }
      }
      waiting.run();
    }
    const SharedResult result = session.final_result();
    session.close();
    waiting.run();
    return result;
  };
  const SharedResult waited_for = answer({{0}, {1}});
  const SharedResult passed_over = answer({{0}, {1, 2}, {-1}});
  ASSERT_TRUE(waited_for && passed_over);
  EXPECT_EQ(passed_over->revision, 4U);
  EXPECT_EQ(passed_over->report.status, EquilibriumStatus::kConverged);
  const double size = waited_for->frames->rightCols<1>().cwiseAbs().maxCoeff();
  EXPECT_LT((passed_over->frames->rightCols<1>() - waited_for->frames->rightCols<1>())
                .cwiseAbs()
                .maxCoeff(),
            1e-5 * size);
  EXPECT_NEAR(passed_over->report.energies.total(), waited_for->report.energies.total(),
              1e-9 * waited_for->report.energies.total());
  // From then on it has an answer of its own.
  expect_the_same(answer({{0}, {1, 2}, {-1}, {-2}, {-1}}), passed_over, "undo once more");
}

TEST(UndoAnswers, AreKeptAsLongAsTheirConditions) {
  const LiveLinkage live(hyperboloid());
  const auto answer = std::make_shared<const CachedEquilibrium>(
      CachedEquilibrium{CachedEquilibrium::Kind::kReached, live.state(), {}, live.sizes()});
  const std::weak_ptr<const CachedEquilibrium> watched = answer;
  EquilibriumCache cache;
  auto first = std::make_shared<const scene::LinkageConditions>();
  const auto second = std::make_shared<const scene::LinkageConditions>();
  cache.store(first, answer);
  EXPECT_EQ(cache.find(first), answer);
  EXPECT_EQ(cache.find(second), nullptr);
  first.reset();
  cache.store(second, std::make_shared<const CachedEquilibrium>(*answer));
  EXPECT_EQ(watched.use_count(), 1) << "only this test's";
}

}  // namespace
}  // namespace limber::session
