// Final results are optima of the full rotation-strain map, shown by full reconstruction.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <map>
#include <thread>

#include "engine/reduced/full_reconstruction.h"
#include "engine/session/bodies/full_body.h"
#include "engine/session/bodies/problem_mapping.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using spacetime::SolveStatus;
using test::held;
using test::kTip;
using test::Live;
using test::tip_at;

/// A model that is far from its tolerance, on purpose.
scene::Scene coarse_bar() {
  scene::Scene scene = test::bent_bar();
  scene.model.basis_size = 8;
  scene.model.cubature_size = 3;
  scene.constraints = {held(10, kTip, {0.02, 0.25, 0.1}), held(20, kTip, {-0.05, -0.3, 0.05})};
  return scene;
}

/// The motion of a result by the full map, without anything of the session, 3n x N [m].
Eigen::MatrixXd full_motion(const scene::Scene& scene, const BodySession& session,
                            const BodyResult& result) {
  const MappedBody mapped = map_body(scene);
  const reduced::FullReconstruction full(mapped.body);
  return full.from_linear(session.model()->modes * (result.material->mixing * result.modal));
}

Eigen::MatrixXd shown_motion(const BodyResult& result) {
  return *result.shown->basis * result.coordinates.cast<double>();
}

TEST(SessionExact, FinalResultsAreOptimaOfTheFullMap) {
  const scene::Scene scene = coarse_bar();
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->is_exact);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  // Constraint energy and errors from whole reconstructions.
  const Eigen::MatrixXd u = full_motion(scene, live.session, *result);
  const double length = live.session.model()->length;
  double energy = 0, largest = 0;
  for (const scene::Constraint& constraint : scene.constraints) {
    const Eigen::Vector3d miss = u.col(constraint.frame).segment<3>(3 * kTip) - constraint.target;
    energy += 0.5 * constraint.weight * (miss / length).squaredNorm();
    largest = std::max(largest, miss.norm());
  }
  EXPECT_NEAR(result->report.constraint_energy, energy, 1e-9 * result->report.total_energy);
  EXPECT_NEAR(result->report.max_constraint_error, largest, 1e-9 * length);
  // The reduced model's own answer is another one.
  SessionOptions reduced;
  reduced.exactness = Exactness::kReduced;
  Live other(scene, reduced);
  const auto answer = other.recorder->wait_final(0);
  ASSERT_TRUE(answer);
  EXPECT_FALSE(answer->is_exact);
  EXPECT_GT(std::abs(answer->report.total_energy / result->report.total_energy - 1), 0.01);
}

TEST(SessionExact, ShownFramesAreFullReconstructions) {
  const scene::Scene scene = coarse_bar();
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  const Eigen::MatrixXd u = full_motion(scene, live.session, *result);
  EXPECT_LT((shown_motion(*result) - u).norm(), 1.5e-3 * u.norm());
  EXPECT_GT(result->shown->basis->cols(), live.session.model()->basis_size());
  const Eigen::MatrixXd& basis = *result->shown->basis;
  EXPECT_LT((basis.transpose() * basis - Eigen::MatrixXd::Identity(basis.cols(), basis.cols()))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
  // Held nodes are where the full map has them, not only nearly.
  for (const scene::Constraint& constraint : scene.constraints) {
    const Eigen::Vector3d shown = shown_motion(*result).col(constraint.frame).segment<3>(3 * kTip);
    EXPECT_LT((shown - u.col(constraint.frame).segment<3>(3 * kTip)).norm(), 1e-6);
  }
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked && checked->motion_check);
  EXPECT_LT(checked->motion_check->error.shape_error, 2e-3);
}

TEST(SessionExact, ExactConstraintsAreMetInTheShownFrames) {
  scene::Scene scene = coarse_bar();
  for (auto& constraint : scene.constraints) constraint.weight = test::kInfinity;
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_LT(result->report.max_exact_error, 1e-7);
  for (const scene::Constraint& constraint : scene.constraints) {
    const Eigen::Vector3d rest = scene.mesh.nodes.col(kTip);
    const Eigen::Vector3d at = tip_at(live.session, *result, constraint.frame);
    EXPECT_LT((at - rest - constraint.target).norm(), 2e-6);
  }
}

/// An edit too small to see must not make the frames jump, though the model is off by percents.
TEST(SessionExact, DragsOnBeginWhereTheLastResultIs) {
  Live live(coarse_bar());
  const auto before = live.recorder->wait_final(0);
  ASSERT_TRUE(before);
  const auto after = live.edit({MoveConstraint{1, {0.02, 0.2501, 0.1}}});
  ASSERT_TRUE(after);
  const double motion = shown_motion(*before).norm();
  double largest = 0;
  for (const auto& result : live.recorder->results()) {
    if (result->revision != after->revision) continue;
    const Eigen::MatrixXd shown = shown_motion(*result);
    const Eigen::MatrixXd then = shown_motion(*before);
    // Bases grow: both in nodes.
    largest = std::max(largest, (shown - then).norm() / motion);
  }
  EXPECT_GT(largest, 0);
  EXPECT_LT(largest, 0.01);
}

TEST(SessionExact, UndoAcrossAGrownBasisGivesTheVeryAnswer) {
  Live live(coarse_bar());
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const auto second = live.edit({MoveConstraint{1, {0.1, 0.1, 0.4}}});
  ASSERT_TRUE(second);
  EXPECT_NE(first->shown->geometry->basis_hash, second->shown->geometry->basis_hash);
  const auto undone = live.edit({Undo{}});
  ASSERT_TRUE(undone);
  EXPECT_EQ(undone->modal, first->modal);
  EXPECT_EQ(undone->coordinates, first->coordinates);
  EXPECT_EQ(undone->shown->geometry->basis_hash, first->shown->geometry->basis_hash);
  EXPECT_TRUE(live.session.geometry(second->shown->geometry->basis_hash));
  EXPECT_FALSE(live.session.geometry("unknown"));
}

/// Frames of an older result stay readable while the basis grows.
TEST(SessionExact, OlderResultsKeepTheirFrames) {
  Live live(coarse_bar());
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const Eigen::MatrixXd positions = live.session.positions(*first, 0, 30);
  ASSERT_TRUE(live.edit({MoveConstraint{1, {0.1, 0.1, 0.4}}}));
  EXPECT_EQ(live.session.positions(*first, 0, 30), positions);
}

TEST(SessionExact, BasisForgetsWhatNoMotionNeeds) {
  Live live(coarse_bar());
  ASSERT_TRUE(live.recorder->wait_final(0));
  const int own = live.session.model()->basis_size();
  for (int i = 0; i < 12; ++i) {
    const double angle = 0.7 * i;
    const auto result =
        live.edit({MoveConstraint{1, {0.05, 0.35 * std::cos(angle), 0.35 * std::sin(angle)}}});
    ASSERT_TRUE(result);
    EXPECT_LE(result->shown->basis->cols(), own + ShowOptions().max_added);
  }
}

TEST(SessionExact, CancellingTheStepLeavesAnAnswer) {
  Live live(coarse_bar());
  ASSERT_TRUE(live.recorder->wait_final(0));
  live.recorder->hook = [&](const BodyResult& result) {
    if (!result.is_final) live.session.cancel();
  };
  const auto result = live.edit({MoveConstraint{1, {0.1, 0.1, 0.4}}});
  live.recorder->hook = nullptr;
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->is_final);
  EXPECT_TRUE(result->coordinates.allFinite());
}

/// As often as edits come quicker than the exact step, it is begun and let go.
TEST(SessionExact, AnEditLetsTheStepGoAndTheNextAnswerIsTheSame) {
  Live undisturbed(coarse_bar());
  ASSERT_TRUE(undisturbed.recorder->wait_final(0));
  const auto at = [](int i) { return MoveConstraint{1, {0.02, 0.25 - 0.02 * i, 0.1}}; };
  constexpr int kEdits = 5;
  std::shared_ptr<const BodyResult> expected;
  for (int i = 1; i <= kEdits; ++i) expected = undisturbed.edit({at(i)});
  ASSERT_TRUE(expected);

  Live live(coarse_bar());
  ASSERT_TRUE(live.recorder->wait_final(0));
  // What is published last before a final result is what the exact step begins with.
  std::map<Revision, int> published;
  live.recorder->hook = [&](const BodyResult& result) {
    if (result.is_final || ++published[result.revision] != 2 || result.revision == kEdits) return;
    live.session.edit({at(static_cast<int>(result.revision) + 1)});
  };
  live.session.edit({at(1)});
  const auto result = live.recorder->wait_final(kEdits);
  live.recorder->hook = nullptr;
  ASSERT_TRUE(result);
  for (const auto& earlier : live.recorder->results())
    EXPECT_FALSE(earlier->is_final && earlier->revision > 0 && earlier->revision < kEdits);
  EXPECT_TRUE(result->is_exact);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  EXPECT_NEAR(result->report.total_energy, expected->report.total_energy,
              1e-6 * expected->report.total_energy);
}

/// Far edits are compared with the optimum from rest, which shows nothing until it is known. Edits
/// come at many times, some of them then: the next begins in the exact answer, or, where the exact
/// step itself is let go, on the way there from the reduced model's.
TEST(SessionExact, AnEditDuringTheComparisonFromRestBeginsInTheAnswer) {
  scene::Scene scene = coarse_bar();
  scene.frame_count = 120;
  const std::vector<BodyEdit> far_edit{MoveConstraint{1, {0.2, -0.4, -0.2}}};
  Live undisturbed(scene);
  ASSERT_TRUE(undisturbed.recorder->wait_final(0));
  const auto answer = undisturbed.edit(far_edit);
  ASSERT_TRUE(answer);
  for (int i = 0; i < 120; ++i) {
    Live live(scene);
    ASSERT_TRUE(live.recorder->wait_final(0));
    std::atomic<int> seen{0};
    live.recorder->hook = [&](const BodyResult& result) {
      if (result.revision == 1) ++seen;
    };
    live.session.edit(far_edit);
    while (seen < 2) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::microseconds(15 * i));
    live.session.edit({MoveConstraint{1, {0.2, -0.4001, -0.2}}});
    ASSERT_TRUE(live.recorder->wait_final(2));
    live.recorder->hook = nullptr;
    std::shared_ptr<const BodyResult> before, first;
    for (const auto& result : live.recorder->results()) {
      if (result->revision == 1) before = result;
      if (result->revision == 2 && !first) first = result;
    }
    const double apart = (answer->modal - before->modal).norm() + 0.01 * answer->modal.norm();
    EXPECT_LT((first->modal - before->modal).norm(), 1.5 * apart) << i;
    EXPECT_LT((first->modal - answer->modal).norm(), 1.5 * apart) << i;
    EXPECT_GT(answer->modal.norm(), 2 * apart) << "rest is farther away";
  }
}

TEST(SessionExact, ABodyOfOneTet) {
  scene::Scene scene = test::bent_bar();
  scene.mesh.nodes = (Eigen::Matrix3Xd(3, 4) << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1).finished();
  scene.mesh.tets = Eigen::Vector4i(0, 1, 2, 3);
  scene.fixed_nodes = {0, 1, 2};
  scene.model = {};
  scene.constraints = {held(10, 3, {0.1, 0.2, 0.1}), held(20, 3, {-0.1, 0.1, -0.1})};
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->is_exact);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  const Eigen::MatrixXd u = full_motion(scene, live.session, *result);
  EXPECT_LT((shown_motion(*result) - u).norm(), 1e-6 * u.norm());
}

/// What the basis cannot hold is said, with what was reached; energies are exact all the same.
TEST(SessionExact, ASceneThatAsksForOneMillionth) {
  scene::Scene scene = coarse_bar();
  scene.model.basis_size = scene.model.cubature_size = 0;
  scene.model.tolerance = 1.01e-6;
  Live live(scene);
  const auto result = live.recorder->wait_final(0);
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->is_exact);
  EXPECT_EQ(result->report.status, SolveStatus::kConverged) << result->report.message;
  const auto checked = live.recorder->wait_checked(0);
  ASSERT_TRUE(checked && checked->motion_check);
  const double error = checked->motion_check->error.shape_error;
  EXPECT_LT(error, 1e-4);
  if (error > scene.model.tolerance) {
    EXPECT_THAT(checked->report.message, ::testing::HasSubstr("off by"));
  }
}

TEST(SessionExact, ACancelledShowLeavesTheLastBasis) {
  Live live(coarse_bar());
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  // An edit right behind another interrupts the exact step or its frames of the first.
  for (int i = 0; i < 20; ++i) live.session.edit({MoveConstraint{1, {0.02, 0.25 + 0.01 * i, 0.1}}});
  const auto last = live.recorder->wait_final(live.session.revision());
  ASSERT_TRUE(last);
  EXPECT_TRUE(last->is_exact);
  EXPECT_EQ(last->coordinates.rows(), last->shown->basis->cols());
  EXPECT_EQ(live.recorder->fault(), "");
}

}  // namespace
}  // namespace limber::session
