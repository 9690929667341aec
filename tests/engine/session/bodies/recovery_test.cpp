#include "engine/session/bodies/recovery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/bodies/modal_analysis.h"
#include "engine/reduced/full_reconstruction.h"
#include "engine/reduced/scaled_modes.h"
#include "engine/session/bodies/geometry.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/session/bodies/simulation.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

using spacetime::RecoveryStart;
using ::testing::HasSubstr;

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kFps = 30;

struct Swing {
  int mode = 0;  // of the elastic ones
  double amplitude = 0, frequency_hz = 0, damping_ratio = 0, phase = 0;
};

/// Modes of the body that swing as prescribed, for any material; RS shapes.
scene::Scene swinging(scene::Scene scene, const std::vector<Swing>& swings) {
  const MappedBody mapped = map_body(scene);
  bodies::ModalOptions options;
  options.mode_count = 8;
  const reduced::ScaledModes modes =
      reduced::scale_modes(mapped.body, bodies::modal_analysis(mapped.body, options));
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(modes.count(), scene.frame_count);
  for (const Swing& swing : swings) {
    const double omega = kTwoPi * swing.frequency_hz, decay = swing.damping_ratio * omega;
    const double damped = omega * std::sqrt(1 - swing.damping_ratio * swing.damping_ratio);
    for (int i = 0; i < scene.frame_count; ++i) {
      const double t = i / kFps;
      z(modes.rigid_count + swing.mode, i) +=
          swing.amplitude * std::exp(-decay * t) * std::cos(damped * t + swing.phase);
    }
  }
  const Eigen::MatrixXd u = reduced::FullReconstruction(mapped.body).from_linear(modes.modes * z);
  return with_base_motion(scene, source_positions(scene, mapped, u));
}

scene::Scene base_scene(int frames) {
  scene::Scene scene = test::bar(5, frames);
  scene.material.youngs_modulus = 1;  // generic
  scene.material.density = 1;
  scene.dynamics.frames_per_second = kFps;
  scene.model.mode_count = 2;
  scene.model.candidate_modes = 20;
  return scene;
}

/// The recovered mode that is nearest in frequency.
spacetime::ModeResponse nearest(const RecoveryReport& report, double frequency_hz) {
  spacetime::ModeResponse best;
  for (Eigen::Index k = 0; k < report.dynamics.stiffness.size(); ++k) {
    const auto response =
        spacetime::mode_response(report.dynamics.stiffness[k], report.dynamics.damping[k], kFps);
    if (std::abs(response.frequency_hz - frequency_hz) < std::abs(best.frequency_hz - frequency_hz))
      best = response;
  }
  return best;
}

const std::vector<Swing> kTwo = {{0, 0.3, 1.3, 0.02}, {1, 0.15, 2.9, 0.05, 0.3}};

TEST(SceneRecovery, KnownFrequenciesAndDampingComeBack) {
  const scene::Scene scene = swinging(base_scene(80), kTwo);
  const MaterialRecovery recovery = recover(scene, {});
  const RecoveryReport& report = recovery.report;
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(report.recovered_frames, 40);
  ASSERT_EQ(report.dynamics.stiffness.size(), 2);
  EXPECT_EQ(report.mixing.rows(), 20);
  for (const Swing& swing : kTwo) {
    const auto got = nearest(report, swing.frequency_hz);
    EXPECT_NEAR(got.frequency_hz, swing.frequency_hz, 0.01 * swing.frequency_hz);
    EXPECT_NEAR(got.damping_ratio, swing.damping_ratio, 0.05 * swing.damping_ratio);
  }
  EXPECT_LT(report.recovered_error, 0.01);
  EXPECT_LT(report.continued_error, 0.02);
  EXPECT_LT(report.projection_error, 0.01);
  ASSERT_EQ(recovery.positions.cols(), 80);
  const Eigen::MatrixXd moved = with_base_motion(scene, recovery.positions).base_motion;
  const double off = (moved.rightCols(40) - scene.base_motion.rightCols(40)).norm();
  EXPECT_NEAR(off / scene.base_motion.rightCols(40).norm(), report.continued_error, 1e-5);
}

/// A square bar of length 4 along x, held at x = 0: two bending modes with near-equal frequencies,
/// which differ since the diagonals of its cubes are not mirrored.
scene::Scene square_bar() {
  scene::Scene scene;
  constexpr int kLong = 8, kWide = 3;
  const auto node = [](int i, int j, int k) { return (i * (kWide + 1) + j) * (kWide + 1) + k; };
  scene.mesh.nodes.resize(3, node(kLong, kWide, kWide) + 1);
  for (int i = 0; i <= kLong; ++i)
    for (int j = 0; j <= kWide; ++j)
      for (int k = 0; k <= kWide; ++k) {
        scene.mesh.nodes.col(node(i, j, k)) << 0.5 * i, j / 3.0, k / 3.0;
        if (i == 0) scene.fixed_nodes.push_back(node(i, j, k));
      }
  // Kuhn's six tets of a cube: one for each order of the axes; odd orders are mirrored.
  std::vector<Eigen::Vector4i> tets;
  for (int i = 0; i < kLong; ++i)
    for (int j = 0; j < kWide; ++j)
      for (int k = 0; k < kWide; ++k) {
        Eigen::Vector3i axes(0, 1, 2);
        do {
          Eigen::Vector3i at(i, j, k);
          Eigen::Vector4i tet;
          tet[0] = node(at[0], at[1], at[2]);
          for (int part = 0; part < 3; ++part) {
            ++at[axes[part]];
            tet[part + 1] = node(at[0], at[1], at[2]);
          }
          const bool is_odd = axes == Eigen::Vector3i(0, 2, 1) ||
                              axes == Eigen::Vector3i(1, 0, 2) || axes == Eigen::Vector3i(2, 1, 0);
          if (is_odd) std::swap(tet[2], tet[3]);
          tets.push_back(tet);
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
  scene.mesh.tets.resize(4, static_cast<Eigen::Index>(tets.size()));
  for (std::size_t t = 0; t < tets.size(); ++t)
    scene.mesh.tets.col(static_cast<Eigen::Index>(t)) = tets[t];
  scene.frame_count = 300;
  scene.material = {3.6e6, 0.4, 1000};
  scene.dynamics.frames_per_second = kFps;
  return scene;
}

// The reference is the full model: implicit steps of St. Venant-Kirchhoff material, no modes.
TEST(Recovery, SquareBarIsContinuedWithinTenPercent) {
  scene::Scene scene = square_bar();
  scene.simulation.emplace();
  scene.simulation->initial.modes = {0.1, 0.1, 0.06, 0.05};
  scene.simulation->steps_per_frame = 4;
  scene = with_base_motion(scene, simulate(scene).positions);
  bodies::ModalOptions two;
  two.mode_count = 2;
  const Eigen::VectorXd hertz =
      bodies::modal_analysis(map_body(scene).body, two).eigenvalues.cwiseSqrt() / kTwoPi;
  ASSERT_LT(hertz[1], 1.15 * hertz[0]);
  for (const int modes : {4, 10}) {
    scene.model.mode_count = modes;
    const RecoveryReport report = recover(scene, {}).report;
    EXPECT_TRUE(report.converged) << modes;
    EXPECT_EQ(report.message, "") << modes;
    EXPECT_LT(report.continued_error, 0.1) << modes;
    for (const double expected : hertz)
      EXPECT_NEAR(nearest(report, expected).frequency_hz, expected, 0.005 * expected) << modes;
  }
}

// 60 frames are two seconds: a fifth of the beat of the two.
TEST(Recovery, AContinuationThatIsOffIsReported) {
  scene::Scene scene = base_scene(120);
  scene.model.mode_count = 1;
  scene = swinging(scene, {{0, 0.3, 0.748, 0}, {1, 0.3, 0.843, 0}});
  const RecoveryReport report = recover(scene, {}).report;
  ASSERT_GT(report.continued_error, 0.1);
  EXPECT_THAT(report.message, HasSubstr("the continuation is off by"));
}

TEST(SceneRecovery, ASimulatedBodyOfTwoMaterialsIsRecoveredWithoutThem) {
  // Soft behind the middle, mass-damped: alpha / (2 omega) of critical.
  scene::Scene truth = base_scene(90);
  truth.mesh.materials = {{4e5, 0.45, 1000}, {4e4, 0.45, 1000}};
  for (int tet = 0; tet < truth.mesh.tet_count(); ++tet) {
    const double x = truth.mesh.nodes(0, truth.mesh.tets(0, tet));
    truth.mesh.tet_material.push_back(x < 0.25 ? 0 : 1);
  }
  const MappedBody mapped = map_body(truth);
  bodies::ModalOptions one;
  one.mode_count = 1;
  const double omega = std::sqrt(bodies::modal_analysis(mapped.body, one).eigenvalues[0]);
  truth.simulation.emplace();
  truth.simulation->initial.modes = {0.01};
  truth.simulation->frames_per_second = 25 * omega / kTwoPi;  // 25 frames a swing
  truth.simulation->steps_per_frame = 2;
  truth.simulation->mass_damping = 0.06 * omega;
  truth.dynamics.frames_per_second = *truth.simulation->frames_per_second;
  scene::Scene unknown = with_base_motion(truth, simulate(truth).positions);
  unknown.mesh.materials.clear();
  unknown.mesh.tet_material.clear();
  unknown.model.mode_count = 1;
  unknown.model.candidate_modes = 70;  // a kink in the middle is no low mode of a uniform bar
  const RecoveryReport report = recover(unknown, {}).report;
  const auto got = spacetime::mode_response(report.dynamics.stiffness[0],
                                            report.dynamics.damping[0], report.frames_per_second);
  EXPECT_NEAR(got.frequency_hz, omega / kTwoPi, 0.01 * omega / kTwoPi);
  EXPECT_NEAR(got.damping_ratio, 0.03, 0.05 * 0.03);
  EXPECT_LT(report.final_frame_error, 0.05);
  EXPECT_EQ(report.message, "");
  EXPECT_THAT(recover(with_base_motion(truth, simulate(truth).positions), {}).report.message,
              HasSubstr("2 materials of the mesh"));
}

TEST(SceneRecovery, MixedModesAreNeededWhereTheMotionIsAMixture) {
  // One swing of two modes at once is one mode of another material.
  const scene::Scene scene = [] {
    scene::Scene made = base_scene(60);
    made.model.mode_count = 1;
    return swinging(made, {{0, 0.3, 1.7, 0.01}, {2, 0.2, 1.7, 0.01}});
  }();
  RecoveryRequest request;
  const RecoveryReport all = recover(scene, request).report;
  request.variables = spacetime::MaterialVariables::kMotionAndDynamics;
  const RecoveryReport dynamics = recover(scene, request).report;
  EXPECT_LT(100 * all.energies.constraint, dynamics.energies.constraint);
  EXPECT_LT(5 * all.recovered_error, dynamics.recovered_error);
  EXPECT_EQ(dynamics.mixing, Eigen::MatrixXd::Identity(20, 1));
}

TEST(SceneRecovery, AFreeBodyFliesOnAsItFlew) {
  scene::Scene scene = base_scene(60);
  scene.fixed_nodes.clear();
  scene = swinging(scene, {{1, 0.2, 2, 0.02}});
  const Eigen::Vector3d step(0.01, -0.02, 0.005);  // [scene units per frame]
  for (int i = 0; i < 60; ++i)
    scene.base_motion.col(i) += (i * step).replicate(scene.mesh.node_count(), 1);
  scene.model.mode_count = 1;
  const RecoveryReport report = recover(scene, {}).report;
  ASSERT_EQ(report.dynamics.stiffness.size(), 7);
  EXPECT_TRUE(report.dynamics.stiffness.head(6).isZero(0));
  EXPECT_EQ(report.mixing.topLeftCorner(6, 6), Eigen::MatrixXd::Identity(6, 6));
  EXPECT_NEAR(nearest(report, 2).frequency_hz, 2, 0.02);
  EXPECT_LT(report.final_frame_error, 0.01);
}

TEST(SceneRecovery, ContinuesBehindTheBaseMotion) {
  const scene::Scene all = swinging(base_scene(80), kTwo);
  scene::Scene half = all;
  half.frame_count = 40;
  half.base_motion = all.base_motion.leftCols(40);
  RecoveryRequest request;
  request.recovered_frames = 40;
  const MaterialRecovery of_all = recover(all, request);
  request.total_frames = 80;
  const MaterialRecovery of_half = recover(half, request);
  EXPECT_EQ(of_half.positions, of_all.positions);
  EXPECT_EQ(of_half.report.continued_error, 0);
  EXPECT_EQ(of_half.report.final_frame_error, 0);
}

TEST(SceneRecovery, ASceneWithAShorterMotionKeepsWhatIsInItsFrames) {
  scene::Scene scene = test::bar(2, 20);
  scene.constraints = {test::held(9, 1), test::held(10, 1)};
  scene.keyframes.resize(2);
  scene.keyframes[0].frame = 12;
  scene.keyframes[1].frame = 3;
  const Eigen::VectorXd rest = scene.mesh.nodes.reshaped();
  const scene::Scene shorter = with_base_motion(scene, rest.replicate(1, 10));
  EXPECT_EQ(shorter.frame_count, 10);
  ASSERT_EQ(shorter.constraints.size(), 1u);
  EXPECT_EQ(shorter.constraints[0].frame, 9);
  ASSERT_EQ(shorter.keyframes.size(), 1u);
  EXPECT_EQ(shorter.keyframes[0].frame, 3);
}

TEST(SceneRecovery, TheUnitOfLengthDoesNotMatter) {
  const scene::Scene metres = swinging(base_scene(40), kTwo);
  scene::Scene millimetres = metres;
  millimetres.length_unit_in_metres = 0.001;
  millimetres.mesh.nodes *= 1000;
  millimetres.base_motion *= 1000;
  const MaterialRecovery a = recover(metres, {}), b = recover(millimetres, {});
  EXPECT_LT((a.report.dynamics.stiffness - b.report.dynamics.stiffness).norm(), 1e-6);
  EXPECT_LT((b.positions / 1000 - a.positions).cwiseAbs().maxCoeff(), 1e-5);
}

TEST(SceneRecovery, NoMotionHasNoMaterial) {
  scene::Scene scene = base_scene(30);
  scene.base_motion = Eigen::MatrixXd::Zero(scene.mesh.nodes.size(), 30);
  const MaterialRecovery recovery = recover(scene, {});
  EXPECT_TRUE(recovery.report.dynamics.stiffness.isZero(0));
  EXPECT_THAT(recovery.report.message, HasSubstr("the motion is zero"));
  EXPECT_EQ(recovery.report.recovered_error, 0);
  EXPECT_EQ(recovery.report.final_frame_error, 0);
  EXPECT_TRUE(with_base_motion(scene, recovery.positions).base_motion.isZero(1e-7));
}

TEST(SceneRecovery, RefusalsNameTheField) {
  const auto field = [](const RecoveryRequest& request, int frames = 40) -> std::string {
    try {
      (void)request.resolved(frames);
    } catch (const Error& error) {
      return error.field();
    }
    return "accepted";
  };
  RecoveryRequest request;
  EXPECT_EQ(field(request, 16), "accepted");
  EXPECT_EQ(field(request, 15), "recovered_frames");
  request.driven_frames = 13;
  EXPECT_EQ(field(request), "recovered_frames");
  request.driven_frames = -1;
  EXPECT_EQ(field(request), "driven_frames");
  request = {};
  request.recovered_frames = 41;
  EXPECT_EQ(field(request), "recovered_frames");
  request.recovered_frames = 30;
  request.total_frames = 29;
  EXPECT_EQ(field(request), "total_frames");
  for (const double bad : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    request = {};
    request.weight = bad;
    EXPECT_EQ(field(request), "weight");
    request.weight = 1;
    request.column_weight = bad;
    EXPECT_EQ(field(request), "column_weight");
  }
  try {
    (void)recover(base_scene(40), {});
    FAIL() << "recovered from nothing";
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "base_motion");
  }
}

TEST(SceneRecovery, CanBeCancelled) {
  const scene::Scene scene = swinging(base_scene(40), kTwo);
  for (const double from : {0.2, 0.4, 0.6}) {
    JobContext job;
    job.progress = [&](const std::string&, double fraction) {
      if (fraction > from) job.cancellation.request();
    };
    try {
      (void)recover(scene, {}, job);
      FAIL() << "ran to its end";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kCancelled);
    }
  }
}

}  // namespace
}  // namespace limber::session
