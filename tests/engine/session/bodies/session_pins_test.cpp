// Pins that follow paths which are edited live, from the edit to the frames that a client gets.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <numbers>

#include "engine/base/error.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using scene::End;
using test::held;
using test::kCells;
using test::kInfinity;
using test::kTip;
using test::Live;

constexpr int kPinnedFrames = 40;

scene::Scene free_bar() {
  scene::Scene scene = test::bar(kCells, kPinnedFrames);
  scene.first_end = scene.last_end = End::kFree;
  scene.dynamics.period_frames = 15;
  return scene;
}

/// Positions of a node, turned about z by `angle` and moved by `way` along z, both from 0 on.
Eigen::Vector3d carried(const Eigen::Vector3d& at, double angle, double way, int frame) {
  const double share = frame / double(kPinnedFrames - 1);
  return Eigen::AngleAxisd(share * angle, Eigen::Vector3d::UnitZ()) * at +
         Eigen::Vector3d(0, 0, share * way);
}

PinPaths turned(const scene::Scene& scene, double angle, double way) {
  Eigen::MatrixXd paths(3 * static_cast<Eigen::Index>(scene.fixed_nodes.size()), kPinnedFrames);
  for (int frame = 0; frame < kPinnedFrames; ++frame)
    for (std::size_t pin = 0; pin < scene.fixed_nodes.size(); ++pin)
      paths.col(frame).segment<3>(3 * static_cast<Eigen::Index>(pin)) =
          carried(scene.mesh.nodes.col(scene.fixed_nodes[pin]), angle, way, frame);
  return std::make_shared<const Eigen::MatrixXd>(std::move(paths));
}

/// The farthest that a node of a result is from the turned body.
double distance_from_turned(const Live& live, const BodyResult& result, const scene::Scene& scene,
                            double angle, double way) {
  double farthest = 0;
  const Eigen::MatrixXd shown = live.session.positions(result, 0, kPinnedFrames);
  for (int frame = 0; frame < kPinnedFrames; ++frame)
    for (int node = 0; node < scene.mesh.node_count(); ++node)
      farthest = std::max(farthest, (shown.col(frame).segment<3>(3 * node) -
                                     carried(scene.mesh.nodes.col(node), angle, way, frame))
                                        .norm());
  return farthest;
}

TEST(SessionPins, CarryABodyThatHadNoBaseMotion) {
  const scene::Scene scene = free_bar();
  Live live(scene);
  (void)live.recorder->wait_final(0);
  const double angle = std::numbers::pi / 2;
  const auto revision = live.session.edit({SetPins{turned(scene, angle, 0.3)}}).revision;
  const auto result = live.recorder->wait_final(revision);
  EXPECT_EQ(result->report.status, spacetime::SolveStatus::kConverged) << result->report.message;
  EXPECT_LT(distance_from_turned(live, *result, scene, angle, 0.3), 1e-4);
  for (const auto& shown : live.recorder->results()) {
    if (shown->revision != revision) continue;
    EXPECT_LT(distance_from_turned(live, *shown, scene, angle, 0.3), 1e-3)
        << "what comes before the final result shows the pins, too";
  }
}

/// What is opened with the same paths has the same answer.
TEST(SessionPins, AreAsOfASceneThatWasOpenedWithThem) {
  scene::Scene scene = free_bar();
  scene::Constraint tip = held(25, kTip, {0.02, 0.15, 0.1});
  tip.weight = kInfinity;
  scene.constraints = {tip, held(12, kTip, {0, 0.02, 0.1})};
  scene.dynamics.inertia = 1;
  Live live(scene);
  (void)live.recorder->wait_final(0);
  (void)live.edit({SetPins{turned(scene, 0.3, 0.1)}});
  const PinPaths paths = turned(scene, 0.4, 0.15);
  const auto edited = live.edit({SetPins{paths}});
  EXPECT_EQ(edited->report.status, spacetime::SolveStatus::kConverged) << edited->report.message;
  EXPECT_LT(
      (test::tip_at(live.session, *edited, 25) - scene.mesh.nodes.col(kTip) - tip.target).norm(),
      1e-5);
  const scene::Scene saved = live.session.scene();
  ASSERT_EQ(saved.base_motion.cols(), kPinnedFrames);
  Live fresh(saved);
  const auto opened = fresh.recorder->wait_final(0);
  EXPECT_NEAR(edited->report.total_energy, opened->report.total_energy,
              1e-6 * opened->report.total_energy);
  const Eigen::MatrixXd one = live.session.positions(*edited, 0, kPinnedFrames);
  EXPECT_LT((one - fresh.session.positions(*opened, 0, kPinnedFrames)).cwiseAbs().maxCoeff(), 5e-4);
}

TEST(SessionPins, AreUndoneAndDoneAgain) {
  scene::Scene scene = free_bar();
  scene.constraints = {held(25, kTip, {0.02, 0.05, 0.1})};
  Live live(scene);
  const auto before = live.recorder->wait_final(0);
  const auto moved = live.edit({SetPins{turned(scene, 0.3, 0.1)}});
  EXPECT_NE(moved->report.total_energy, before->report.total_energy);
  const auto back = live.edit({Undo{}});
  EXPECT_NEAR(back->report.total_energy, before->report.total_energy,
              1e-9 * before->report.total_energy);
  EXPECT_LT((live.session.positions(*back, 0, kPinnedFrames) -
             live.session.positions(*before, 0, kPinnedFrames))
                .cwiseAbs()
                .maxCoeff(),
            1e-6);
  const auto again = live.edit({Redo{}});
  EXPECT_NEAR(again->report.total_energy, moved->report.total_energy,
              1e-9 * moved->report.total_energy);
  // Removed constraints and other edits of the same request are not lost.
  const auto both = live.edit({RemoveConstraint{1}, SetPins{}});
  EXPECT_LT(both->report.total_energy, 1e-12);
  EXPECT_LT(distance_from_turned(live, *both, scene, 0, 0), 1e-6);
}

TEST(SessionPins, KeepWhatWasFitted) {
  scene::Scene scene = free_bar();
  scene.constraints = {held(12, kTip, {0, 0.1, 0.05}), held(25, kTip, {0, -0.1, 0.02})};
  scene.material_optimisation.variables = scene::MaterialVariables::kDynamics;
  Live live(scene);
  (void)live.recorder->wait_final(0);
  const auto frozen = live.edit({SetMaterialVariables{scene::MaterialVariables::kMotion}});
  ASSERT_NE(frozen->material->dynamics.stiffness[0],
            frozen->initial_material->dynamics.stiffness[0]);
  const auto moved = live.edit({SetPins{turned(scene, 0.1, 0.02)}});
  EXPECT_EQ(moved->material->dynamics.stiffness, frozen->material->dynamics.stiffness);
}

TEST(SessionPins, AnswersOfTheModelAloneAndLoopsFollowToo) {
  scene::Scene scene = free_bar();
  SessionOptions reduced;
  reduced.exactness = Exactness::kReduced;
  Live live(scene, reduced);
  (void)live.recorder->wait_final(0);
  const auto moved = live.edit({SetPins{turned(scene, 0.5, 0.2)}});
  EXPECT_LT(distance_from_turned(live, *moved, scene, 0.5, 0.2), 1e-3);
  // Edits of all kinds in one request, pins among them.
  const auto looped =
      live.edit({SetEnds{End::kCyclic, End::kCyclic}, SetDynamics{{30, 20, 0.5}},
                 AddConstraint{held(20, kTip, {0, 0.1, 0.1})}, SetPins{turned(scene, 0, 0.1)}});
  EXPECT_EQ(looped->report.status, spacetime::SolveStatus::kConverged) << looped->report.message;
  EXPECT_LT(looped->report.max_constraint_error, 0.01);
}

TEST(SessionPins, WhatIsWrongIsNamed) {
  const scene::Scene scene = free_bar();
  Live live(scene);
  const auto refused = [](Eigen::MatrixXd paths, Live& of) {
    try {
      (void)of.session.edit({SetPins{std::make_shared<const Eigen::MatrixXd>(std::move(paths))}});
    } catch (const Error& error) {
      EXPECT_EQ(error.field(), "edits[0].set_pins.pins");
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const Eigen::MatrixXd good = *turned(scene, 0, 0);
  Eigen::MatrixXd bad = good;
  bad(4, 7) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refused(bad, live).find("not finite: node 1 in frame 7"), std::string::npos);
  bad(4, 7) = 1e9;
  EXPECT_NE(refused(bad, live).find("body lengths"), std::string::npos);
  EXPECT_NE(refused(good.leftCols(kPinnedFrames - 1), live).find("frames"), std::string::npos);
  EXPECT_NE(refused(good.topRows(3), live).find("fixed nodes"), std::string::npos);
  scene::Scene unfixed = scene;
  unfixed.fixed_nodes.clear();
  Live loose(unfixed);
  EXPECT_NE(refused(good, loose).find("no fixed nodes"), std::string::npos);
}

}  // namespace
}  // namespace limber::session
