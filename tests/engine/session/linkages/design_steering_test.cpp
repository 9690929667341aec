// Designs that are steered while they run: changes in quick succession, stops, and what is seen
// last.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "engine/rods/design/mesh_surface.h"
#include "tests/engine/session/linkages/live_designs.h"

namespace limber::session {
namespace {

using namespace limber::session::testing;

constexpr double kFarAway = 1e5;

/// A square over the linkage, 200 to a side, as far away as asked.
std::shared_ptr<const rods::TargetSurface> sheet(double away) {
  rods::SurfaceMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 200, 200, 0, 0, 0, 200, 200, 10, 10, 10, 10;
  mesh.vertices.row(0).array() += away;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  return std::make_shared<rods::MeshSurface>(mesh);
}

/// Neither of two changes is far away, and both together are.
TEST(DesignSteering, AChangeIsJudgedTogetherWithThoseBeforeIt) {
  LiveDesignSession live;
  std::string second, third;
  live.watcher->hook = [&](const DesignInfo& info) {
    if (info.iteration != 2 || info.state != DesignState::kRunning || !second.empty()) return;
    DesignChange surface, away, back;
    surface.surface = sheet(0);
    live.session.change_design(surface);
    away.placement = rods::SurfacePlacement{.translation = {kFarAway, 0, 0}};
    second = refused_field([&] { live.session.change_design(away); });
    back.surface = sheet(-kFarAway);
    back.placement = rods::SurfacePlacement{.translation = {kFarAway, 0, 0}};
    third = refused_field([&] { live.session.change_design(back); });
  };
  DesignRequest wanted = request();
  wanted.max_iterations = 6;
  live.session.start_design(wanted);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(second, "surface");
  EXPECT_EQ(third, "none");
  EXPECT_NE(end->end, DesignEnd::kFailed) << end->message;
  EXPECT_TRUE(end->goal.surface);
  EXPECT_EQ(end->goal.placement.translation.x(), kFarAway);
}

TEST(DesignSteering, BeforeItsFirstStepChangesAreJudgedTogetherToo) {
  LiveDesignSession live;
  std::string refused;
  live.watcher->hook = [&](const DesignInfo& info) {
    if (info.state != DesignState::kStarting) return;
    DesignChange surface, away;
    surface.surface = sheet(0);
    live.session.change_design(surface);
    away.placement = rods::SurfacePlacement{.translation = {0, kFarAway, 0}};
    refused = refused_field([&] { live.session.change_design(away); });
  };
  DesignRequest wanted = request();
  wanted.max_iterations = 3;
  live.session.start_design(wanted);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(refused, "surface");
  EXPECT_NE(end->end, DesignEnd::kFailed) << end->message;
  EXPECT_EQ(end->goal.placement.translation.y(), 0);
}

TEST(DesignSteering, WeightsOfJointsChangeWhileItRuns) {
  LiveDesignSession live;
  live.watcher->hook = [&](const DesignInfo& info) {
    if (info.iteration == 2 && info.state == DesignState::kRunning) live.session.pause_design();
  };
  DesignRequest wanted = request();
  wanted.goal.targets.clear();
  wanted.goal.surface = sheet(0);
  live.session.start_design(wanted);
  const auto paused = live.watcher->wait_design(
      [](const DesignInfo& info) { return info.state == DesignState::kPaused; });
  ASSERT_TRUE(paused);
  DesignChange bad, weights;
  bad.joint_surface_weights = Eigen::VectorXd::Ones(7);
  EXPECT_EQ(refused_field([&] { live.session.change_design(bad); }), "joint_surface_weights");
  bad.joint_surface_weights = -Eigen::VectorXd::Ones(25);
  EXPECT_EQ(refused_field([&] { live.session.change_design(bad); }), "joint_surface_weights[0]");
  weights.joint_surface_weights = 0.01 * Eigen::VectorXd::Ones(25);
  live.session.change_design(weights);
  const auto changed = live.watcher->wait_design(
      [](const DesignInfo& info) { return info.goal.joint_surface_weights.size() == 25; });
  ASSERT_TRUE(changed);
  EXPECT_LT(changed->now.objective, 0.1 * paused->now.objective);
  EXPECT_EQ(changed->now.surface_rms, paused->now.surface_rms);
  live.session.stop_design();
  ASSERT_TRUE(live.watcher->wait_end());
}

/// Paused before its third step.
std::shared_ptr<const DesignInfo> pause_early(LiveDesignSession& live,
                                              const DesignRequest& wanted) {
  live.watcher->hook = [&live](const DesignInfo& info) {
    if (info.iteration == 2 && info.state == DesignState::kRunning) live.session.pause_design();
  };
  live.session.start_design(wanted);
  auto paused = live.watcher->wait_design(
      [](const DesignInfo& info) { return info.state == DesignState::kPaused; });
  live.watcher->hook = {};
  return paused;
}

TEST(DesignSteering, WeightsThatNobodyCanReckonWithAreRefusedAtOnce) {
  LiveDesignSession live;
  const auto goals = [](const auto& spoil) {
    DesignRequest wanted = request();
    wanted.goal.surface = sheet(0);
    spoil(wanted.goal);
    return wanted;
  };
  const auto start = [&](const auto& spoil) {
    return refused_field([&] { live.session.start_design(goals(spoil)); });
  };
  const Eigen::VectorXd heavy = Eigen::VectorXd::Constant(25, 1e300);
  EXPECT_EQ(start([](DesignGoal& goal) { goal.distance_weight = 1e31; }), "goal.distance_weight");
  EXPECT_EQ(start([](DesignGoal& goal) { goal.surface_weight = 1e200; }), "goal.surface_weight");
  EXPECT_EQ(start([](DesignGoal& goal) { goal.targets[4].weight = 1e300; }),
            "goal.targets[4].weight");
  EXPECT_EQ(start([&](DesignGoal& goal) { goal.joint_surface_weights = heavy; }),
            "goal.joint_surface_weights[0]");

  ASSERT_TRUE(pause_early(live, goals([](DesignGoal& goal) { goal.surface_weight = 0.01; })));
  const auto change = [&](const auto& spoil) {
    DesignChange bad;
    spoil(bad);
    return refused_field([&] { live.session.change_design(bad); });
  };
  EXPECT_EQ(change([](DesignChange& bad) { bad.distance_weight = 1e31; }), "distance_weight");
  EXPECT_EQ(change([](DesignChange& bad) { bad.surface_weight = 1e200; }), "surface_weight");
  EXPECT_EQ(change([](DesignChange& bad) {
              bad.targets = request().goal.targets;
              (*bad.targets)[4].weight = 1e300;
            }),
            "targets[4].weight");
  EXPECT_EQ(change([&](DesignChange& bad) { bad.joint_surface_weights = heavy; }),
            "joint_surface_weights[0]");
  live.session.resume_design();
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_NE(end->end, DesignEnd::kFailed) << end->message;
  EXPECT_EQ(end->goal.distance_weight, request().goal.distance_weight);
  EXPECT_EQ(end->goal.joint_surface_weights.size(), 0);
  EXPECT_EQ(end->taken, 1U) << end->message;
}

TEST(DesignSteering, WhereItBeganIsJudgedByTheNewGoalToo) {
  LiveDesignSession live;
  const Eigen::Matrix3Xd joints = live.joints(*live.session.final_result());
  const auto paused = pause_early(live, request());
  ASSERT_TRUE(paused);
  EXPECT_GT(paused->start.target_rms, 0.1);
  DesignChange change;
  change.distance_weight = 1e7;
  auto& targets = change.targets.emplace();
  for (int j = 0; j < joints.cols(); ++j)
    targets.push_back({j, joints.col(j) + Eigen::Vector3d(0, 3, 4), 1});
  live.session.change_design(change);
  const auto changed = live.watcher->wait_design(
      [](const DesignInfo& info) { return info.goal.distance_weight == 1e7; });
  ASSERT_TRUE(changed);
  EXPECT_NEAR(changed->start.target_rms, 5, 1e-4);
  EXPECT_EQ(changed->start.flat_energy, paused->start.flat_energy);
  EXPECT_NE(changed->start.objective, paused->start.objective);
  EXPECT_GT(std::abs(changed->now.target_rms - 5), 1e-3) << "it has left it since";
  live.session.stop_design();
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->start.objective, changed->start.objective);
}

TEST(DesignSteering, StoppedTheSessionHasItsShapeAtOnce) {
  LiveDesignSession live;
  const auto before = live.session.final_result();
  ASSERT_TRUE(before);
  int seen_at_stop = 0;
  bool was_its_own = false;
  live.watcher->hook = [&](const DesignInfo& info) {
    if (info.iteration == 4 && info.state == DesignState::kRunning && seen_at_stop == 0) {
      seen_at_stop = 1;
      was_its_own = live.session.newest_result()->design == nullptr;
      live.session.stop_design();
      const auto newest = live.session.newest_result();
      EXPECT_FALSE(newest->design);
      EXPECT_EQ(live.joints(*newest), live.joints(*before));
    }
    if (info.state != DesignState::kEnded) return;
    const auto newest = live.session.newest_result();
    EXPECT_FALSE(newest->design);
    EXPECT_TRUE(newest->is_final);
    EXPECT_EQ(live.joints(*newest), live.joints(*before));
    EXPECT_EQ(live.watcher->results().back(), newest) << "and the watchers have been notified";
    EXPECT_GT(newest->sequence, before->sequence);
  };
  live.session.start_design(request());
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->end, DesignEnd::kStopped);
  EXPECT_EQ(seen_at_stop, 1);
  EXPECT_FALSE(was_its_own) << "the step before was shown";
  live.watcher->hook = {};
  const auto sequences = live.watcher->results();
  for (std::size_t i = 1; i < sequences.size(); ++i)
    EXPECT_EQ(sequences[i]->sequence, sequences[i - 1]->sequence + 1);
  const auto opened = live.edit({SetMeanAngle{0.95}});
  ASSERT_TRUE(opened);
  EXPECT_FALSE(opened->solve_failed);
}

/// Of a design that buckles again and again.
/// @param went_back  counts steps without a trial taken after which it stands elsewhere
void demand_terms_of_shapes(double distance_weight, int& went_back) {
  LiveDesignSession live;
  DesignRequest wanted = request();
  for (rods::JointTarget& target : wanted.goal.targets) target.position *= 1.4;
  wanted.goal.distance_weight = distance_weight;
  wanted.flat_height = 0.02;
  wanted.max_iterations = 80;
  wanted.guard = rods::BucklingGuard::kFromStart;
  live.session.start_design(wanted);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  Eigen::Matrix3Xd last;
  std::shared_ptr<const DesignInfo> shown;
  for (const auto& result : live.watcher->results()) {
    if (!result->design) continue;
    shown = result->design;
    const Eigen::Matrix3Xd joints = live.joints(*result);
    double sum = 0;
    for (const auto& target : wanted.goal.targets)
      sum += (joints.col(target.joint) - target.position).squaredNorm();
    const double rms = std::sqrt(sum / static_cast<double>(wanted.goal.targets.size()));
    EXPECT_NEAR(rms, shown->now.target_rms, 1e-4) << shown->iteration;
    if (last.cols() > 0 && !shown->accepted && (joints - last).norm() > 1e-3) ++went_back;
    last = joints;
  }
  // What is seen last is what there is to take.
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->now.objective, end->best.objective);
  EXPECT_EQ(end->now.objective, end->best.objective);
  const auto best = live.session.best_design();
  ASSERT_TRUE(best);
  for (Eigen::Index j = 0; j < last.cols(); ++j) {
    const auto& joint = best->deployed.joints()[static_cast<std::size_t>(j)];
    EXPECT_LT((joint.position - last.col(j)).norm(), 1e-2) << j;
  }
}

/// The guard against buckling goes back to earlier shapes, and searches may end elsewhere than at
/// the best.
TEST(DesignSteering, TermsAreThoseOfTheShapeThatIsShown) {
  int went_back = 0;
  for (const double weight : {1e4, 1e5, 1e6, 1e8}) demand_terms_of_shapes(weight, went_back);
  EXPECT_GT(went_back, 0) << "none of them has gone back";
}

/// A plane under the linkage with a callback, called once, when a point is requested.
class CallbackPlane : public rods::TargetSurface {
 public:
  [[nodiscard]] rods::ClosestPoint closest(const Eigen::Vector3d& point) const override {
    if (const auto call = std::exchange(call_, {})) call();
    rods::ClosestPoint result;
    result.position = {point.x(), point.y(), -5};
    result.derivative.diagonal() << 1, 1, 0;
    return result;
  }
  void call_next(std::function<void()> call) { call_ = std::move(call); }

 private:
  mutable std::function<void()> call_;
};

/// Designs that run alike, and what clients want of one after its last step. Each is the second for
/// its goal: at its end it is compared with the first one, whose distance to the surface is asked
/// for then.
class LastStretch {
 public:
  using Want = std::function<void(LinkageSession&)>;
  LastStretch() {
    if (const auto end = run({})) alone_ = *end;
    EXPECT_TRUE(alone_.end == DesignEnd::kConverged || alone_.end == DesignEnd::kSettled);
    EXPECT_EQ(alone_.taken, kTaken);
  }
  /// How it ends by itself.
  [[nodiscard]] const DesignInfo& alone() const { return alone_; }
  /// @param want  within the task, after the last step and before the end
  /// @param then  while it is paused; empty: it is not
  std::shared_ptr<const DesignInfo> run(const Want& want, const Want& then = {});
  void expect_not_taken(const DesignInfo& end);
  void expect_gone_on(const DesignInfo& end);
  static constexpr Revision kBefore = 2, kTaken = 3;

 private:
  std::optional<LiveDesignSession> live_;
  Eigen::Matrix3Xd before_;
  DesignInfo alone_;
};

std::shared_ptr<const DesignInfo> LastStretch::run(const Want& want, const Want& then) {
  LiveDesignSession& live = live_.emplace();
  const auto plane = std::make_shared<CallbackPlane>();
  DesignRequest wanted = request();
  wanted.goal.distance_weight = 1e6;
  wanted.goal.surface = plane;
  wanted.goal.surface_weight = 1e-2;
  live.session.start_design(wanted);
  EXPECT_TRUE(live.watcher->wait_end());
  before_ = live.joints(*live.edit({Undo{}}));
  live.watcher->forget();
  bool asked = false;
  live.watcher->hook = [&](const DesignInfo& info) {
    if (!want || asked || info.iteration != alone_.iteration) return;
    asked = true;
    plane->call_next([&] { want(live.session); });
  };
  live.session.start_design(wanted);
  if (then) {
    EXPECT_TRUE(live.watcher->wait_design(
        [](const DesignInfo& info) { return info.state == DesignState::kPaused; }));
    EXPECT_EQ(live.session.design()->end, DesignEnd::kNone);
    then(live.session);
  }
  return live.watcher->wait_end();
}

DesignChange heavier() {
  DesignChange change;
  change.distance_weight = 1e8;
  return change;
}

void LastStretch::expect_not_taken(const DesignInfo& end) {
  EXPECT_EQ(end.end, DesignEnd::kStopped) << end.message;
  const bool is_reported =
      end.message.find("no erection was searched for, since the design was stopped") !=
      std::string::npos;
  ASSERT_TRUE(end.erection);  // of a way to open, or of why none is known
  EXPECT_EQ(is_reported, !end.erection->failure.empty()) << end.message;
  EXPECT_EQ(end.iteration, alone_.iteration);
  EXPECT_FALSE(end.taken);
  EXPECT_EQ(live_->session.revision(), kBefore);
  EXPECT_EQ(live_->joints(*live_->session.newest_result()), before_);
  EXPECT_EQ(live_->session.take_design().revision, kTaken) << "it is there to be taken";
}

void LastStretch::expect_gone_on(const DesignInfo& end) {
  EXPECT_EQ(end.goal.distance_weight, 1e8);
  EXPECT_GT(end.iteration, alone_.iteration);
  EXPECT_LT(end.best.target_rms, alone_.best.target_rms);
  EXPECT_EQ(end.taken, kTaken) << end.message;
  EXPECT_EQ(live_->session.revision(), kTaken);
}

TEST(DesignLastStretch, AStopAfterTheLastStepIsObeyed) {
  LastStretch last;
  const auto end = last.run([](LinkageSession& session) { session.stop_design(); });
  ASSERT_TRUE(end);
  last.expect_not_taken(*end);
}

TEST(DesignLastStretch, AChangeAfterTheLastStepIsGoneOnTo) {
  LastStretch last;
  const auto end = last.run([](LinkageSession& session) { session.change_design(heavier()); });
  ASSERT_TRUE(end);
  last.expect_gone_on(*end);
}

TEST(DesignLastStretch, APauseAfterTheLastStepIsKept) {
  LastStretch last;
  const auto pause = [](LinkageSession& session) { session.pause_design(); };
  auto end = last.run(pause, [](LinkageSession& session) { session.resume_design(); });
  ASSERT_TRUE(end);
  EXPECT_EQ(end->end, last.alone().end);
  EXPECT_EQ(end->iteration, last.alone().iteration);
  EXPECT_EQ(end->best.objective, last.alone().best.objective);
  EXPECT_EQ(end->message, last.alone().message);
  EXPECT_EQ(end->taken, LastStretch::kTaken);

  end = last.run(pause, [](LinkageSession& session) {
    session.change_design(heavier());
    session.resume_design();
  });
  ASSERT_TRUE(end);
  last.expect_gone_on(*end);

  end = last.run(pause, [](LinkageSession& session) { session.stop_design(); });
  ASSERT_TRUE(end);
  last.expect_not_taken(*end);
}

}  // namespace
}  // namespace limber::session
