#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using test::bent_bar;
using test::kTip;
using test::Pool;
using test::Recorder;

SessionOptions with_picture() {
  SessionOptions options;
  options.first_picture_tets = 1;
  return options;
}

/// A session that builds its model, and waits in the stage "basis" of that until it is told.
struct Building {
  explicit Building(scene::Scene scene, SessionOptions options = with_picture()) {
    recorder->progress_hook = [this](const Progress& progress) {
      if (progress.stage != "basis" || is_reached) return;
      is_reached = true;
      reached.set_value();
      resumed.get_future().wait();
    };
    session = std::make_unique<BodySession>("live", std::move(scene), options,
                                            std::make_shared<ModelCache>(std::filesystem::path()),
                                            pool.executor(), recorder);
  }
  void wait() { reached.get_future().wait(); }
  void resume() { resumed.set_value(); }

  std::promise<void> reached, resumed;
  bool is_reached = false;
  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>();
  Pool pool{1};
  std::unique_ptr<BodySession> session;
};

std::shared_ptr<const BodyResult> solve_without_picture(const scene::Scene& scene) {
  SessionOptions options;
  options.first_picture_tets = std::numeric_limits<int>::max();
  return test::solve_fresh(scene, std::make_shared<ModelCache>(std::filesystem::path()), options);
}

TEST(FirstPicture, IsShownWhileTheModelIsBuiltAndLeavesNoTraceInTheAnswer) {
  Building live(bent_bar());
  live.wait();
  EXPECT_EQ(live.session->state(), State::kBuilding);
  EXPECT_EQ(live.session->model(), nullptr);
  EXPECT_EQ(live.session->final_result(), nullptr);
  const auto picture = live.session->newest_result();
  ASSERT_TRUE(picture);
  EXPECT_TRUE(picture->is_first_picture);
  EXPECT_FALSE(picture->is_final);
  EXPECT_FALSE(picture->is_exact);
  EXPECT_THAT(picture->report.message, ::testing::HasSubstr("First picture"));
  const Eigen::Vector3d moved =
      test::tip_at(*live.session, *picture, 10) - live.session->geometry()->rest.col(kTip);
  EXPECT_LT((moved - Eigen::Vector3d(0, 0.1, 0.05)).norm(), 0.03);
  live.resume();
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_FALSE(final->is_first_picture);
  const auto alone = solve_without_picture(bent_bar());
  ASSERT_TRUE(alone);
  EXPECT_EQ(final->modal, alone->modal);
  EXPECT_EQ(final->coordinates, alone->coordinates);
  EXPECT_EQ(final->report.total_energy, alone->report.total_energy);
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(FirstPicture, EditsAreShownMeanwhileAndOutliveTheSwap) {
  Building live(bent_bar());
  live.wait();
  const std::uint64_t before = live.session->newest_result()->sequence;
  EXPECT_EQ(live.session->edit({MoveConstraint{1, {0, 0.15, 0.05}}}).revision, 1u);
  live.resume();
  const auto final = live.recorder->wait_final(1);
  ASSERT_TRUE(final);
  const auto shown = live.recorder->next_solved(before);
  ASSERT_TRUE(shown);
  EXPECT_TRUE(shown->is_first_picture);
  EXPECT_EQ(shown->revision, 1u);
  EXPECT_FALSE(shown->is_final);
  scene::Scene edited = bent_bar();
  edited.constraints[0].target = {0, 0.15, 0.05};
  const auto alone = solve_without_picture(edited);
  EXPECT_EQ(final->modal, alone->modal);
  EXPECT_EQ(final->coordinates, alone->coordinates);
  // No result was final before the model was there.
  for (const auto& result : live.recorder->results())
    EXPECT_FALSE(result->is_final && result->is_first_picture);
  ASSERT_TRUE(live.session->edit({Undo{}}).revision == 2u);
  const auto undone = live.recorder->wait_final(2);
  const auto original = solve_without_picture(bent_bar());
  EXPECT_NEAR(undone->report.total_energy, original->report.total_energy,
              1e-6 * original->report.total_energy);
}

TEST(FirstPicture, ACancelledBuildKeepsItAndCanBeTakenUp) {
  Building live(bent_bar());
  live.wait();
  live.session->cancel();
  live.resume();
  ASSERT_TRUE(live.recorder->wait_state(State::kFailed));
  EXPECT_TRUE(live.session->newest_result()->is_first_picture);
  EXPECT_TRUE(live.session->geometry());
  live.session->solve_cold();
  const auto final = live.recorder->wait_final(0);
  ASSERT_TRUE(final);
  EXPECT_EQ(final->coordinates, solve_without_picture(bent_bar())->coordinates);
}

TEST(FirstPicture, AnotherClientCanStillReadItsFramesAfterTheSwap) {
  Building live(bent_bar());
  live.wait();
  const auto picture = live.session->newest_result();
  const Eigen::MatrixXd before = live.session->positions(*picture, 0, 30);
  const std::string hash = live.session->geometry()->basis_hash;
  live.resume();
  ASSERT_TRUE(live.recorder->wait_final(0));
  EXPECT_NE(live.session->geometry()->basis_hash, hash);
  const auto geometry = live.session->geometry(hash);
  ASSERT_TRUE(geometry);
  EXPECT_EQ(geometry->basis, picture->shown->geometry->basis);
  EXPECT_EQ(live.session->positions(*picture, 0, 30), before);
}

TEST(FirstPicture, ClosingMeanwhileEndsIt) {
  auto live = std::make_unique<Building>(bent_bar());
  live->wait();
  auto closing = std::async(std::launch::async, [&] { live->session->close(); });
  live->resume();
  closing.get();
  EXPECT_EQ(live->session->state(), State::kClosed);
  EXPECT_TRUE(live->session->newest_result()->is_first_picture);
}

TEST(FirstPicture, SmallBodiesAndThoseWithABaseMotionHaveNone) {
  for (const bool is_moved : {false, true}) {
    scene::Scene scene = bent_bar();
    SessionOptions options = with_picture();
    if (is_moved) {
      scene.base_motion.setZero(scene.mesh.nodes.size(), scene.frame_count);
    } else {
      options.first_picture_tets = 4000;
    }
    Building live(scene, options);
    live.wait();
    EXPECT_EQ(live.session->newest_result(), nullptr);
    live.resume();
    EXPECT_TRUE(live.recorder->wait_final(0));
  }
}

}  // namespace
}  // namespace limber::session
