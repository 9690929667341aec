// Sessions whose scenes do not name r choose it: by the energy of the optimum, to the scene's
// tolerance.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <utility>

#include "engine/session/bodies/live_problem.h"
#include "engine/session/bodies/mode_chooser.h"
#include "tests/engine/session/bodies/mode_scenes.h"

namespace limber::session {
namespace {

using Chosen = ModeChoice::State;
using test::choosing;
using test::demanding_bar;
using test::easy_bar;
using test::held;
using test::kTip;
using test::Live;
using test::pull_apart;
using test::pulled_apart;
using test::settled;
using test::unnamed_bar;

/// Of demanding_bar(): far beyond what it was asked for.
const MoveConstraint kLargeMove{3, {0.08, 0.24, -0.2}};
const MoveConstraint kSmallMove{1, {0.001, 0.1, 0.05}};

std::shared_ptr<const BodyResult> solve_with(scene::Scene scene, int modes) {
  scene.model.mode_count = modes;
  return test::solve_fresh(scene, test::shared_cache());
}

int elastic_modes(const BodySession& session) {
  return session.model()->coordinate_count() - session.model()->rigid_count;
}

TEST(SessionModes, GrowUntilTheEnergyOfTheOptimumSettles) {
  Live live(demanding_bar(), choosing());
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const auto last = settled(live.session);
  ASSERT_TRUE(last);
  const ModeChoice choice = live.session.mode_choice();
  EXPECT_EQ(choice.state, Chosen::kSettled) << choice.reason;
  EXPECT_GT(choice.modes, 30);
  EXPECT_EQ(elastic_modes(live.session), choice.modes);
  ASSERT_GE(choice.energies.size(), 3u);
  for (std::size_t i = 1; i < choice.energies.size(); ++i)
    EXPECT_LE(choice.energies[i].energy, choice.energies[i - 1].energy * (1 + 1e-9));
  ASSERT_TRUE(choice.saving);
  EXPECT_LE(*choice.saving, 0.01);
  // As if the scene had named them; and the first answer was that of the default.
  const auto named = solve_with(demanding_bar(), choice.modes);
  ASSERT_TRUE(named);
  EXPECT_NEAR(last->report.total_energy, named->report.total_energy,
              1e-6 * named->report.total_energy);
  EXPECT_EQ(first->report.total_energy, solve_with(demanding_bar(), 30)->report.total_energy);
  EXPECT_EQ(last->revision, 0u);
  EXPECT_TRUE(last->is_exact);
  EXPECT_TRUE(last->motion_check);
  EXPECT_THAT(last->report.message, ::testing::HasSubstr("in place of 30"));
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionModes, StayWhereMoreOfThemChangeNothing) {
  Live live(easy_bar(), choosing());
  const auto first = live.recorder->wait_final(0);
  const auto last = settled(live.session);
  ASSERT_TRUE(first && last);
  const ModeChoice choice = live.session.mode_choice();
  EXPECT_EQ(choice.state, Chosen::kSettled);
  EXPECT_EQ(choice.modes, 30);
  EXPECT_EQ(last->modal, first->modal);
  EXPECT_EQ(last->coordinates, first->coordinates);
  EXPECT_EQ(last->report.total_energy, first->report.total_energy);
  EXPECT_EQ(last->shown, first->shown);
}

/// Its energy is that of rounding, and so is what other modes change of it.
TEST(SessionModes, StayWhereABodyMovesWithoutForces) {
  scene::Scene scene = easy_bar();
  scene.fixed_nodes.clear();
  scene.first_end = scene.last_end = scene::End::kFree;
  scene.constraints.resize(1);
  scene.constraints[0].nodes.resize(1);
  Live live(scene, choosing());
  const auto last = settled(live.session);
  ASSERT_TRUE(last);
  EXPECT_LT(last->report.total_energy, 1e-15);
  const ModeChoice choice = live.session.mode_choice();
  EXPECT_EQ(choice.state, Chosen::kSettled) << choice.reason;
  EXPECT_EQ(choice.modes, 30);
  EXPECT_EQ(choice.energies.size(), 1u);
}

TEST(SessionModes, StayWhereTheSceneNamesThem) {
  scene::Scene scene = demanding_bar();
  scene.model.modes_by = scene::ModelRequest::ModesBy::kScene;
  Live live(scene, choosing());
  ASSERT_TRUE(settled(live.session));
  EXPECT_EQ(live.session.mode_choice().state, Chosen::kNamed);
  EXPECT_EQ(elastic_modes(live.session), 30);
  scene = demanding_bar();
  scene.model.mode_count = 12;
  Live twelve(scene, choosing());
  ASSERT_TRUE(settled(twelve.session));
  EXPECT_EQ(twelve.session.mode_choice().state, Chosen::kNamed);
  Live off(demanding_bar());
  ASSERT_TRUE(settled(off.session));
  EXPECT_EQ(off.session.mode_choice().state, Chosen::kOff);
}

TEST(SessionModes, OneQuestionDoesForManySmallEdits) {
  Live live(demanding_bar(), choosing());
  ASSERT_TRUE(settled(live.session));
  const auto energies = live.session.mode_choice().energies;
  for (int i = 1; i <= 3; ++i) {
    const auto result = live.edit({MoveConstraint{1, {0.001 * i, 0.1, 0.05}}});
    ASSERT_TRUE(result);
    EXPECT_FALSE(result->awaits_modes);
  }
  const auto harder = live.edit({kLargeMove});
  ASSERT_TRUE(harder);
  EXPECT_TRUE(harder->awaits_modes);
  ASSERT_TRUE(settled(live.session, harder->revision));
  const auto elsewhere = live.edit({AddConstraint{held(20, kTip - 1, {0, 0.05, 0})}});
  ASSERT_TRUE(elsewhere);
  EXPECT_TRUE(elsewhere->awaits_modes);
}

TEST(SessionModes, AnEditNeedsMoreOfThemWhileASecondClientReadsFrames) {
  Live live(easy_bar(), choosing());
  ASSERT_TRUE(settled(live.session));
  std::atomic<bool> stop{false};
  std::atomic<int> read{0}, bad{0};
  std::thread reader([&] {
    while (!stop) {
      const auto result = live.session.newest_result();
      const auto geometry = live.session.geometry(result->shown->geometry->basis_hash);
      const bool fits = result->shown->geometry->basis.cols() == result->coordinates.rows() &&
                        result->shown->basis->cols() == result->coordinates.rows() &&
                        live.session.positions(*result, 0, 30).allFinite();
      if (!fits || (geometry && geometry->basis.cols() != result->coordinates.rows())) ++bad;
      ++read;
    }
  });
  const auto receipt = live.session.edit(pull_apart());
  const auto last = settled(live.session, receipt.revision);
  stop = true;
  reader.join();
  ASSERT_TRUE(last);
  const ModeChoice choice = live.session.mode_choice();
  EXPECT_GT(choice.modes, 30) << choice.reason;
  EXPECT_GT(read, 0);
  EXPECT_EQ(bad, 0);
  const auto named = solve_with(live.session.scene(), choice.modes);
  ASSERT_TRUE(named);
  EXPECT_LE(last->report.total_energy, named->report.total_energy * (1 + 1e-6));
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionModes, FramesOfTheSwapAreThoseOfItsOptimum) {
  Live live(demanding_bar(), choosing());
  ASSERT_TRUE(settled(live.session));
  const auto results = live.recorder->results();
  // No iterate of a half-finished solve comes between the two final results.
  std::size_t first = 0;
  while (!results[first]->is_final) ++first;
  for (std::size_t i = first; i < results.size(); ++i) EXPECT_TRUE(results[i]->is_final);
  const Eigen::MatrixXd before = live.session.positions(*results[first], 0, 30);
  const Eigen::MatrixXd after = live.session.positions(*results.back(), 0, 30);
  const Eigen::MatrixXd rest = before.col(0).replicate(1, 30);
  EXPECT_GT(live.session.mode_choice().modes, 30);
  EXPECT_LT((after - before).norm(), 0.2 * (before - rest).norm());
}

TEST(SessionModes, ModelsAreSwappedDuringADrag) {
  Live live(easy_bar(), choosing());
  ASSERT_TRUE(live.recorder->wait_final(0));
  const auto ids = live.session.edit(pull_apart(0)).constraint_ids;
  Revision revision = 0;
  for (int step = 1; step <= 60; ++step) {
    const auto targets = pulled_apart(step / 60.0);
    revision = live.session
                   .edit({MoveConstraint{ids.at(0), targets[0].target},
                          MoveConstraint{ids.at(1), targets[1].target}})
                   .revision;
    std::this_thread::sleep_for(std::chrono::milliseconds(step % 10 == 0 ? 150 : 3));
  }
  const auto last = settled(live.session, revision);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->revision, revision);
  EXPECT_GT(live.session.mode_choice().modes, 30) << live.session.mode_choice().reason;
  const auto named = solve_with(live.session.scene(), live.session.mode_choice().modes);
  ASSERT_TRUE(named);
  EXPECT_NEAR(last->report.total_energy, named->report.total_energy,
              1e-5 * named->report.total_energy);
  for (const auto& result : live.recorder->results()) {
    EXPECT_EQ(result->shown->basis->cols(), result->coordinates.rows());
    EXPECT_FALSE(result->solve_failed) << result->report.message;
  }
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionModes, UndoAcrossASwap) {
  Live live(easy_bar(), choosing());
  const auto before = settled(live.session);
  ASSERT_TRUE(before);
  ASSERT_EQ(before->mode_changes, 0);
  const auto receipt = live.session.edit(pull_apart());
  const auto swapped = settled(live.session, receipt.revision);
  ASSERT_TRUE(swapped);
  ASSERT_GT(swapped->mode_changes, 0);
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_FALSE(undone->solve_failed) << undone->report.message;
  // The same minimum, with more modes.
  EXPECT_LE(undone->report.total_energy, before->report.total_energy * (1 + 1e-9));
  EXPECT_GT(undone->report.total_energy, 0.9 * before->report.total_energy);
  const Eigen::MatrixXd was = live.session.positions(*before, 0, 30);
  EXPECT_LT((live.session.positions(*undone, 0, 30) - was).norm(),
            0.1 * (was - was.col(0).replicate(1, 30)).norm());
  const auto redone = live.edit({Redo{}});
  ASSERT_TRUE(redone);
  EXPECT_NEAR(redone->report.total_energy, swapped->report.total_energy,
              1e-6 * swapped->report.total_energy);
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionModes, CancelledGrowth) {
  const auto recorder = std::make_shared<test::Recorder>();
  test::Pool pool(1);
  std::unique_ptr<BodySession> session;
  std::promise<void> made;
  std::atomic<bool> is_cancelled{false};
  recorder->hook = [&, ready = made.get_future().share()](const BodyResult& result) {
    ready.wait();
    if (result.awaits_modes && result.check == Check::kDone && !is_cancelled.exchange(true))
      session->cancel();
  };
  session = std::make_unique<BodySession>("live", demanding_bar(), choosing(), test::shared_cache(),
                                          pool.executor(), recorder);
  made.set_value();
  const auto result = settled(*session);
  ASSERT_TRUE(result);
  EXPECT_EQ(session->mode_choice().modes, 30);
  EXPECT_THAT(session->mode_choice().reason, ::testing::HasSubstr("cancelled"));
  EXPECT_EQ(result->report.status, spacetime::SolveStatus::kConverged);
  EXPECT_EQ(result->mode_changes, 0);
  // Not asked again for a small edit, but where other nodes are held.
  const auto small = session->edit({kSmallMove});
  ASSERT_TRUE(settled(*session, small.revision));
  EXPECT_EQ(session->mode_choice().modes, 30);
  const auto large = session->edit({AddConstraint{held(20, kTip - 1, {0, -0.1, 0.02})}});
  ASSERT_TRUE(settled(*session, large.revision));
  EXPECT_GT(session->mode_choice().modes, 30) << session->mode_choice().reason;
  EXPECT_EQ(recorder->fault(), "");
}

/// Runs tasks on the thread that posts them until it is told to keep them.
struct Keeper {
  std::vector<std::function<void()>> kept;
  bool keeps = false;
  Executor executor() {
    return [this](std::function<void()> task) {
      if (keeps)
        kept.push_back(std::move(task));
      else
        task();
    };
  }
};

TEST(SessionModes, ACancelledOrClosedComparisonThatWasNotBegun) {
  for (const bool closes : {false, true}) {
    Keeper keeper;
    const auto recorder = std::make_shared<test::Recorder>();
    recorder->hook = [&](const BodyResult& result) {
      if (result.awaits_modes && result.check == Check::kDone) keeper.keeps = true;
    };
    BodySession session("live", demanding_bar(), choosing(), test::shared_cache(),
                        keeper.executor(), recorder);
    ASSERT_EQ(keeper.kept.size(), 1u) << "the comparison waits for a thread";
    keeper.keeps = false;
    closes ? session.close() : session.cancel();
    keeper.kept.front()();
    EXPECT_EQ(session.mode_choice().modes, 30);
    EXPECT_EQ(session.newest_result()->awaits_modes, closes);
    EXPECT_EQ(recorder->fault(), "");
  }
}

/// Where a round is to come, cancel() is for that.
TEST(SessionModes, CancellingAnEditLeavesTheQuestion) {
  Keeper keeper;
  const auto recorder = std::make_shared<test::Recorder>();
  recorder->hook = [&](const BodyResult& result) {
    if (result.awaits_modes && result.check == Check::kDone) keeper.keeps = true;
  };
  BodySession session("live", demanding_bar(), choosing(), test::shared_cache(), keeper.executor(),
                      recorder);
  ASSERT_EQ(keeper.kept.size(), 1u) << "the comparison waits for a thread";
  session.edit({kSmallMove});
  session.cancel();
  recorder->hook = {};
  keeper.keeps = false;
  for (const auto& task : std::exchange(keeper.kept, {})) task();
  EXPECT_EQ(session.newest_result()->report.status, spacetime::SolveStatus::kCancelled);
  EXPECT_THAT(session.mode_choice().reason, ::testing::Not(::testing::HasSubstr("cancelled")));
  session.edit({MoveConstraint{1, {0.002, 0.1, 0.05}}});
  EXPECT_GT(session.mode_choice().modes, 30) << session.mode_choice().reason;
  EXPECT_EQ(recorder->fault(), "");
}

/// What ends the session's change to more modes, while it works on that.
enum class Disturbance { kCancel, kEdit };

class ChangeOfModes : public ::testing::TestWithParam<Disturbance> {};

TEST_P(ChangeOfModes, ThatIsDisturbedLeavesWhatTheSessionSays) {
  const bool edits = GetParam() == Disturbance::kEdit;
  for (int attempt = 0; attempt < 12; ++attempt) {
    Live live(demanding_bar(), choosing());
    ASSERT_TRUE(live.recorder->wait_final(0));
    const auto model = live.session.model();
    Revision revision = 0;
    const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (live.session.model() == model && live.session.mode_choice().modes == 30 &&
           std::chrono::steady_clock::now() < until)
      std::this_thread::yield();
    if (edits)
      revision = live.session.edit({kSmallMove}).revision;
    else
      live.session.cancel();
    const auto last = settled(live.session, revision);
    ASSERT_TRUE(last);
    const ModeChoice choice = live.session.mode_choice();
    EXPECT_EQ(last->modal.rows(), choice.modes) << choice.reason;
    EXPECT_EQ(last->report.status, spacetime::SolveStatus::kConverged);
    EXPECT_EQ(last->mode_changes, choice.modes > 30 ? 1 : 0);
    EXPECT_EQ(elastic_modes(live.session), choice.modes);
    EXPECT_EQ(live.session.geometry()->basis_hash, last->shown->geometry->basis_hash);
    if (edits) {
      EXPECT_GT(choice.modes, 30) << "asked again: " << choice.reason;
    } else if (choice.modes == 30) {
      EXPECT_EQ(choice.state, Chosen::kUnasked);
      EXPECT_THAT(choice.reason, ::testing::HasSubstr("cancelled"));
    }
    const auto next = live.edit({MoveConstraint{1, {0.002, 0.1, 0.05}}});
    ASSERT_TRUE(next);
    EXPECT_FALSE(next->solve_failed) << next->report.message;
    EXPECT_EQ(next->modal.rows(), choice.modes);
    EXPECT_EQ(live.recorder->fault(), "");
  }
}

INSTANTIATE_TEST_SUITE_P(SessionModes, ChangeOfModes,
                         ::testing::Values(Disturbance::kCancel, Disturbance::kEdit));

TEST(SessionModes, AHigherEnergyIsNotTaken) {
  const scene::Scene scene = demanding_bar();
  Live live(scene);
  const auto solved = live.recorder->wait_final(0);
  ASSERT_TRUE(solved);
  const auto body = std::make_shared<const BodyParts>(scene);
  LiveProblem problem(live.session.model(), nullptr, TargetFrame(scene, body->mapped),
                      std::make_unique<KeyframeTargets>(scene, live.session.model()),
                      ProblemTerms{scene.frame_count, 30, {}}, {});
  problem.start(whole_batch(Document(scene)));
  ModeRequest request;
  request.model = live.session.model();
  request.body = body;
  request.problem = problem.mode_problem(scene.dynamics);
  request.modes = 30;
  ModeChooser chooser(std::make_shared<const scene::Scene>(scene), {}, {}, test::shared_cache());
  // As if the shown motion were in a lower minimum than any that is found from it.
  auto lower = std::make_shared<BodyResult>(*solved);
  lower->report.total_energy *= 0.01;
  request.result = lower;
  const ModeFinding finding = chooser.choose(request, {});
  EXPECT_EQ(finding.choice.modes, 30);
  EXPECT_EQ(finding.model, request.model);
  EXPECT_EQ(finding.motion, solved->modal);
  EXPECT_EQ(finding.choice.state, Chosen::kBounded);
  EXPECT_FALSE(finding.choice.saving);
  EXPECT_EQ(finding.choice.energies.size(), 2u);
  EXPECT_THAT(finding.choice.reason, ::testing::HasSubstr("higher energy"));
  request.result = solved;
  EXPECT_GT(chooser.choose(request, {}).choice.modes, 30);
}

TEST(SessionModes, MoreOfThemAreShownWhereTheirOptimumIsFoundAndLower) {
  spacetime::SolveReport before, more;
  before.status = more.status = spacetime::SolveStatus::kConverged;
  before.total_energy = 2;
  more.total_energy = 1.9;
  EXPECT_EQ(reason_against_more_modes(before, more), "");
  more.total_energy = 2.1;
  EXPECT_THAT(reason_against_more_modes(before, more),
              ::testing::HasSubstr("higher energy, 2.1 instead of 2"));
  more.total_energy = 1.9;
  more.status = spacetime::SolveStatus::kIterationLimit;
  more.message = "200 iterations";
  EXPECT_THAT(reason_against_more_modes(before, more),
              ::testing::HasSubstr("not converged: 200 iterations"));
}

TEST(SessionModes, OfABodyOfOneTet) {
  scene::Scene scene = test::two_tets();
  scene.mesh.nodes.conservativeResize(3, 4);
  scene.mesh.tets.conservativeResize(4, 1);
  scene.fixed_nodes = {0, 1};
  scene.model.mode_count = scene::ModelRequest::kDefaultModes;
  scene.constraints = {
      held(5, 3, scene.mesh.nodes.col(3).cwiseAbs() * 0.2 + Eigen::Vector3d(0.05, 0.02, 0.1))};
  Live live(scene, choosing());
  ASSERT_TRUE(settled(live.session));
  const ModeChoice choice = live.session.mode_choice();
  EXPECT_LE(choice.modes, 5);
  EXPECT_EQ(choice.modes, elastic_modes(live.session));
  EXPECT_NE(choice.state, Chosen::kOff);
  EXPECT_FALSE(choice.reason.empty());
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionModes, OfASceneThatAsksForOneInAMillion) {
  scene::Scene scene = demanding_bar();
  scene.model.tolerance = 1.01e-6;
  ModeChoiceOptions options;
  options.most = 60;
  Live live(scene, choosing(options));
  const auto last = settled(live.session);
  ASSERT_TRUE(last);
  const ModeChoice choice = live.session.mode_choice();
  EXPECT_EQ(choice.state, Chosen::kBounded);
  EXPECT_EQ(choice.modes, 60);
  EXPECT_GT(choice.saving.value_or(0), 1e-6);
  EXPECT_THAT(last->report.message, ::testing::HasSubstr("has not settled"));
}

TEST(SessionModes, ShrinkWhereFewerDoAndLeaveWhatIsShown) {
  ModeChoiceOptions options;
  options.shrink_share = 0.9;
  Live live(easy_bar(), choosing(options));
  ASSERT_TRUE(settled(live.session));
  const auto receipt = live.session.edit(pull_apart());
  ASSERT_TRUE(settled(live.session, receipt.revision));
  const int grown = live.session.mode_choice().modes;
  ASSERT_GT(grown, 30);
  // Less is held, elsewhere than before: asked again.
  const auto less = live.session.edit({RemoveConstraint{receipt.constraint_ids[0]},
                                       RemoveConstraint{receipt.constraint_ids[1]},
                                       AddConstraint{held(12, kTip - 1, {0, 0.1, 0.05})}});
  const auto shown = settled(live.session, less.revision);
  ASSERT_TRUE(shown);
  const ModeChoice choice = live.session.mode_choice();
  EXPECT_LT(choice.modes, grown) << choice.reason;
  EXPECT_GE(choice.modes, 30);
  EXPECT_EQ(elastic_modes(live.session), grown) << "the model stays";
  EXPECT_EQ(shown->modal.rows(), grown);
  const auto next = live.edit({MoveConstraint{1, {0.0, 0.1, 0.0501}}});
  ASSERT_TRUE(next);
  EXPECT_EQ(next->modal.rows(), choice.modes);
  EXPECT_FALSE(next->solve_failed);
  const Eigen::MatrixXd was = live.session.positions(*shown, 0, 30);
  EXPECT_LT((live.session.positions(*next, 0, 30) - was).norm(),
            0.05 * (was - was.col(0).replicate(1, 30)).norm());
  // Back to an answer that had more modes.
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_NEAR(undone->report.total_energy, shown->report.total_energy,
              0.05 * shown->report.total_energy);
  EXPECT_EQ(live.recorder->fault(), "");
}

TEST(SessionModes, AreNotComparedWhereEnergiesAreOfOtherProblems) {
  scene::Scene keyed = demanding_bar();
  scene::Keyframe keyframe;
  keyframe.frame = 15;
  keyframe.pose =
      std::make_shared<const Eigen::VectorXd>(Eigen::VectorXd::Zero(3 * keyed.mesh.node_count()));
  keyed.keyframes = {keyframe};
  scene::Scene fitted = demanding_bar();
  fitted.material_optimisation.variables = scene::MaterialVariables::kDynamics;
  scene::Scene free_of_targets = demanding_bar();
  free_of_targets.constraints.clear();
  for (const auto& [scene, word] : {std::pair{keyed, "keyframes"}, std::pair{fitted, "material"},
                                    std::pair{free_of_targets, "nothing"}}) {
    Live live(scene, choosing());
    ASSERT_TRUE(settled(live.session));
    const ModeChoice choice = live.session.mode_choice();
    EXPECT_EQ(choice.state, Chosen::kUnasked) << word;
    EXPECT_EQ(choice.modes, 30);
    EXPECT_THAT(choice.reason, ::testing::HasSubstr(word));
  }
  ModeChoiceOptions small;
  small.most_tets = 10;
  Live large(demanding_bar(), choosing(small));
  ASSERT_TRUE(settled(large.session));
  EXPECT_THAT(large.session.mode_choice().reason, ::testing::HasSubstr("tets"));
}

TEST(SessionModes, OfFreeBodiesExactConstraintsAndBaseMotions) {
  scene::Scene free_body = demanding_bar();
  free_body.fixed_nodes.clear();
  scene::Scene exact = demanding_bar();
  for (auto& constraint : exact.constraints) constraint.weight = test::kInfinity;
  scene::Scene based = demanding_bar();
  based.base_motion =
      Eigen::MatrixXd::Constant(3 * based.mesh.node_count(), based.frame_count, 0.0);
  for (Eigen::Index frame = 0; frame < based.base_motion.cols(); ++frame)
    for (Eigen::Index node = 0; node < based.mesh.node_count(); ++node)
      based.base_motion(3 * node + 1, frame) =
          0.02 * double(frame) / 30 * std::pow(based.mesh.nodes(0, node), 2);
  scene::Scene grouped = demanding_bar();
  grouped.constraints[0].nodes = {kTip, kTip - 1};
  for (const scene::Scene& scene : {free_body, exact, based, grouped}) {
    Live live(scene, choosing());
    const auto last = settled(live.session);
    ASSERT_TRUE(last);
    const ModeChoice choice = live.session.mode_choice();
    EXPECT_NE(choice.state, Chosen::kUnasked) << choice.reason;
    EXPECT_FALSE(last->solve_failed);
    const auto named = solve_with(scene, choice.modes);
    ASSERT_TRUE(named);
    EXPECT_NEAR(last->report.total_energy, named->report.total_energy,
                1e-4 * named->report.total_energy);
    EXPECT_EQ(live.recorder->fault(), "");
  }
}

TEST(SessionModes, TransfersKeepLinearShapes) {
  const scene::Scene scene = unnamed_bar();
  scene::Scene more = scene;
  more.model.mode_count = 45;
  Live a(scene), b(more);
  ASSERT_TRUE(a.recorder->wait_final(0) && b.recorder->wait_final(0));
  const Eigen::MatrixXd transfer = mode_transfer(*a.session.model(), *b.session.model());
  const Eigen::MatrixXd back = b.session.model()->modes * transfer;
  EXPECT_LT((back - a.session.model()->modes).norm(), 1e-6 * a.session.model()->modes.norm());
}

TEST(SessionModes, BadOptionsNameTheirMember) {
  const auto field_of = [](const ModeChoiceOptions& options) {
    try {
      options.validate();
    } catch (const Error& error) {
      return error.field();
    }
    return std::string();
  };
  EXPECT_EQ(field_of({}), "");
  EXPECT_EQ(field_of({.growth = 1}), "mode_choice.growth");
  EXPECT_EQ(field_of({.least = 0}), "mode_choice.least");
  EXPECT_EQ(field_of({.most = 29}), "mode_choice.most");
  EXPECT_EQ(field_of({.shrink_share = 1}), "mode_choice.shrink_share");
  EXPECT_EQ(field_of({.energy_factor = 1}), "mode_choice.energy_factor");
  EXPECT_EQ(field_of({.most_frames = -1}), "mode_choice.most_frames");
}

}  // namespace
}  // namespace limber::session
