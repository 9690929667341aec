// Sampled modes and smooth forces, rows of three and of four terms: against dense solves in long
// double, and what they are for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "engine/spacetime/material_solver.h"
#include "engine/spacetime/solver.h"
#include "tests/engine/spacetime/dense_reference.h"
#include "tests/engine/spacetime/ends.h"
#include "tests/engine/spacetime/scenes.h"

namespace limber::spacetime {
namespace {

using testing::ChainKinematics;
using testing::LinearKinematics;

/// Relative. Exact constraints may be missed by 1e-8, which smooth forces make worth more.
constexpr double kSmoothEnergyAccuracy = 1e-7, kSmoothMotionAccuracy = 1e-5;

/// The forms beside the published one.
std::vector<ModeDynamics> new_forms(ModeDynamics dynamics) {
  std::vector<ModeDynamics> forms;
  for (const auto form : {Discretisation::kDifferences, Discretisation::kSampled}) {
    for (const double smoothing : {0.0, 0.4, 6.0}) {
      if (form == Discretisation::kDifferences && smoothing == 0) continue;
      dynamics.discretisation = form;
      dynamics.smoothing = smoothing;
      forms.push_back(dynamics);
    }
  }
  return forms;
}

void expect_dense_motion(const LinearKinematics& kinematics, const ModeDynamics& dynamics,
                         const Timeline& timeline,
                         const std::vector<PositionConstraint>& constraints,
                         const std::vector<KeyframeConstraint>& keyframes = {},
                         const Eigen::MatrixXd& mixing = {}) {
  SCOPED_TRACE(::testing::Message() << "form " << static_cast<int>(dynamics.discretisation)
                                    << ", smoothing " << dynamics.smoothing);
  const DenseAnswer dense =
      dense_optimum(kinematics, dynamics, timeline, constraints, keyframes, mixing);
  Solver solver(std::make_shared<LinearKinematics>(kinematics), dynamics, timeline, {}, mixing);
  for (const auto& constraint : constraints) solver.add(constraint);
  for (const auto& keyframe : keyframes) solver.add_keyframe(keyframe);
  const SolveReport report = solver.solve();
  EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
  EXPECT_NEAR(report.total_energy, dense.energy, kSmoothEnergyAccuracy * dense.energy);
  EXPECT_NEAR(report.force_energy, force_energy(dynamics, solver.motion(), beginning_of(timeline)),
              kSmoothEnergyAccuracy * dense.energy);
  EXPECT_LE((solver.motion() - dense.z).cwiseAbs().maxCoeff(),
            kSmoothMotionAccuracy * dense.z.cwiseAbs().maxCoeff());
  EXPECT_GT(dense.energy, 0);
  EXPECT_GT(dense.z.cwiseAbs().maxCoeff(), 0.01) << "nothing moves, nothing is tested";
}

class SampledModesEnds : public ::testing::TestWithParam<Ends> {};

TEST_P(SampledModesEnds, Soft) {
  const LinearKinematics kinematics(4, 3, 1.0, 21);
  const Timeline timeline{26, GetParam().first, GetParam().last};
  for (const ModeDynamics& dynamics : new_forms(test_dynamics(4, 15, 0.02)))
    expect_dense_motion(kinematics, dynamics, timeline,
                        linear_constraints(kinematics, 5, 26, 100, 22));
}

TEST_P(SampledModesEnds, Exact) {
  const LinearKinematics kinematics(4, 3, 1.0, 23);
  const Timeline timeline{26, GetParam().first, GetParam().last};
  for (const ModeDynamics& dynamics : new_forms(test_dynamics(4, 15, 0.02)))
    expect_dense_motion(kinematics, dynamics, timeline,
                        linear_constraints(kinematics, 5, 26, kExact, 24));
}

TEST_P(SampledModesEnds, ConstraintsInTheEndFramesAndBesideEachOther) {
  const LinearKinematics kinematics(3, 3, 1.0, 25);
  const Timeline timeline{20, GetParam().first, GetParam().last};
  for (const ModeDynamics& dynamics : new_forms(test_dynamics(3, 15, 0.02))) {
    for (const std::vector<int>& frames :
         {std::vector<int>{0, 1, 8, 9, 18, 19}, {2, 4, 7, 11, 16, 17}, {1, 3, 6, 10, 14, 18}}) {
      auto constraints = linear_constraints(kinematics, 6, 20, 10, 26);
      for (std::size_t i = 0; i < frames.size(); ++i) constraints[i].frame = frames[i];
      expect_dense_motion(kinematics, dynamics, timeline, constraints);
    }
  }
}

TEST_P(SampledModesEnds, VelocitiesAndKeyframes) {
  const LinearKinematics kinematics(4, 3, 1.0, 27);
  const Timeline timeline{26, GetParam().first, GetParam().last};
  std::mt19937_64 generator(3);
  Eigen::MatrixXd mixed = Eigen::MatrixXd::Identity(4, 4);
  for (auto& value : mixed.reshaped()) value += 0.3 * testing::uniform(generator);
  for (const ModeDynamics& dynamics : new_forms(test_dynamics(4, 15, 0.02))) {
    auto constraints = linear_constraints(kinematics, 5, 26, 100, 28);
    constraints[1].since = constraints[1].frame - 2;
    constraints[3].since = constraints[3].frame - 1;
    std::vector<KeyframeConstraint> keyframes;
    for (const int frame : {4, 5, 19}) {
      KeyframeConstraint keyframe{static_cast<ConstraintId>(frame), frame, Eigen::VectorXd(4), 30};
      for (double& value : keyframe.coordinates) value = testing::uniform(generator);
      keyframes.push_back(keyframe);
    }
    expect_dense_motion(kinematics, dynamics, timeline, constraints, keyframes);
    expect_dense_motion(kinematics, dynamics, timeline, constraints, keyframes, mixed);
  }
}

INSTANTIATE_TEST_SUITE_P(All, SampledModesEnds, ::testing::ValuesIn(all_ends()),
                         ::testing::PrintToStringParamName());

TEST(SampledModes, FewFramesAreTheDenseOnes) {
  const LinearKinematics kinematics(2, 3, 1.0, 31);
  for (const int frames : {3, 4, 5, 6}) {
    for (const EndCondition end :
         {EndCondition::kFree, EndCondition::kPinnedPosition, EndCondition::kCyclic}) {
      for (const ModeDynamics& dynamics : new_forms(test_dynamics(2, 15, 0.02))) {
        auto constraints = linear_constraints(kinematics, 2, 9, 50, 32);
        constraints[0].frame = 1;
        constraints[1].frame = frames > 4 ? frames - 2 : 1;
        if (end == EndCondition::kFree) constraints[1].frame = frames - 1;
        expect_dense_motion(kinematics, dynamics, {frames, end, end}, constraints);
      }
    }
  }
}

TEST(SampledModes, StiffSlowAndOverdampedModesTogether) {
  const LinearKinematics kinematics(5, 4, 1.0, 33);
  ModeDynamics dynamics{Eigen::VectorXd(5), Eigen::VectorXd(5)};
  dynamics.stiffness << 0, 1e-6, 0.025, 1, 94;
  for (int k = 0; k < 5; ++k)
    dynamics.damping[k] = 2 * (k == 3 ? 1.5 : 0.2) * std::sqrt(dynamics.stiffness[k]);
  for (const ModeDynamics& form : new_forms(dynamics)) {
    if (form.discretisation == Discretisation::kDifferences) continue;
    expect_dense_motion(kinematics, form, {30}, linear_constraints(kinematics, 5, 30, 100, 34));
  }
}

/// A bending chain: no step from the answer lowers its energy.
TEST(SampledModes, ABendingBodyEndsInAMinimum) {
  const auto chain = std::make_shared<ChainKinematics>(6, 8, 1.0, 2.0, 3);
  const Timeline timeline{60};
  for (const ModeDynamics& dynamics : new_forms(test_dynamics(6, 30, 0.2))) {
    const auto constraints = test_constraints(*chain, 4, timeline, 0.4, 100, 5);
    Solver solver(chain, dynamics, timeline);
    for (const auto& constraint : constraints) solver.add(constraint);
    const SolveReport report = solver.solve();
    EXPECT_EQ(report.status, SolveStatus::kConverged) << report.message;
    const auto energy_of = [&](const Eigen::MatrixXd& z) {
      return force_energy(dynamics, z) + soft_energy(*chain, constraints, z);
    };
    const double energy = energy_of(solver.motion());
    EXPECT_NEAR(report.total_energy, energy, 1e-8 * energy);
    std::mt19937_64 generator(9);
    for (int trial = 0; trial < 20; ++trial) {
      Eigen::MatrixXd moved = solver.motion();
      for (Eigen::Index i = 2; i + 2 < moved.cols(); ++i)
        for (Eigen::Index k = 0; k < moved.rows(); ++k)
          moved(k, i) += 1e-4 * testing::uniform(generator);
      EXPECT_GT(energy_of(moved), energy);
    }
  }
}

/// Modes of a body with a period of 40 frames, up to lambda = 94; a tip that they all move, stiff
/// ones less.
struct StiffBody {
  explicit StiffBody(Discretisation form, double smoothing, double ratio) {
    const int modes = 12;
    const double lowest = std::pow(2 * std::numbers::pi / 40, 2);
    dynamics = {Eigen::VectorXd(modes), Eigen::VectorXd(modes), form, smoothing};
    mixing = Eigen::MatrixXd::Zero(modes, modes);
    for (int k = 0; k < modes; ++k) {
      dynamics.stiffness[k] = lowest * std::pow(94 / lowest, k / (modes - 1.0));
      dynamics.damping[k] = 2 * ratio * std::sqrt(dynamics.stiffness[k]);
      mixing(k, k) = std::sqrt(lowest / dynamics.stiffness[k]);
    }
    kinematics = std::make_shared<LinearKinematics>(modes, 1, 1.0, 7);
  }

  /// Path of the tip led to the same place in these frames, 3 x N.
  [[nodiscard]] Eigen::MatrixXd path(const Timeline& timeline,
                                     const std::vector<int>& frames) const {
    Solver solver(kinematics, dynamics, timeline, {}, mixing);
    for (const int frame : frames) {
      PositionConstraint key;
      key.id = static_cast<ConstraintId>(frame) + 1;
      key.frame = frame;
      key.target = {0.3, 0, 0};
      key.weight = kExact;
      solver.add(key);
    }
    EXPECT_EQ(solver.solve().status, SolveStatus::kConverged);
    return kinematics->maps() * mixing * solver.motion();
  }

  ModeDynamics dynamics;
  Eigen::MatrixXd mixing;
  std::shared_ptr<LinearKinematics> kinematics;
};

double zigzag(const Eigen::MatrixXd& path) {
  double largest = 0;
  for (Eigen::Index i = 1; i + 1 < path.cols(); ++i)
    largest = std::max(largest, (path.col(i) - 0.5 * (path.col(i - 1) + path.col(i + 1))).norm());
  return largest;
}

TEST(SampledModes, DampedAndSmoothedDoNotShakeWhateverTheEnds) {
  const StiffBody published(Discretisation::kDifferences, 0, 0.2),
      calm(Discretisation::kSampled, 8, 0.2);
  for (const Ends ends : all_ends()) {
    const Timeline timeline{129, ends.first, ends.last};
    const double shaken = zigzag(published.path(timeline, {64})),
                 moved = zigzag(calm.path(timeline, {64}));
    EXPECT_LE(moved, 0.02) << static_cast<int>(ends.first) << static_cast<int>(ends.last);
    EXPECT_GT(shaken, 2 * moved);
  }
}

/// Between free ends any free motion through both keys costs no force. With damping those begin a
/// thousand body lengths away, and the published form takes one.
TEST(SampledModes, ADampedMotionDoesNotBeginFarAwayBeforeAFreeEnd) {
  const Timeline timeline{129, EndCondition::kFree, EndCondition::kFree};
  const StiffBody published(Discretisation::kDifferences, 0, 0.2),
      calm(Discretisation::kSampled, 8, 0.2);
  for (const std::vector<int>& keys : {std::vector<int>{20, 108}, {0, 108}, {20, 128}}) {
    EXPECT_GT(published.path(timeline, keys).colwise().norm().maxCoeff(), 20);
    const Eigen::MatrixXd path = calm.path(timeline, keys);
    EXPECT_LE(path.colwise().norm().maxCoeff(), 1);
    EXPECT_LE(zigzag(path), 0.05);
  }
}

/// One scene in seconds at growing rates: what moves with the rate shrinks at least with the step.
TEST(SampledModes, TheMotionConvergesWithTheFrameRate) {
  constexpr double kSeconds = 4, kTau = 0.15;
  const LinearKinematics kinematics(4, 2, 1.0, 41);
  const auto motion_at = [&](int rate, Discretisation form) {
    ModeDynamics dynamics{Eigen::VectorXd(4), Eigen::VectorXd(4), form,
                          form == Discretisation::kSampled ? kTau * rate : 0.0};
    for (int k = 0; k < 4; ++k) {
      const double omega = 2 * std::numbers::pi * std::pow(2.4, k) / rate;
      dynamics.stiffness[k] = omega * omega;
      dynamics.damping[k] = 2 * 0.2 * omega;
    }
    Solver solver(std::make_shared<LinearKinematics>(kinematics), dynamics,
                  {static_cast<int>(kSeconds * rate) + 1});
    for (int i = 0; i < 3; ++i) {
      PositionConstraint key;
      key.id = static_cast<ConstraintId>(i) + 1;
      key.frame = (i + 1) * rate;
      key.axes = 1;
      key.target = {i == 1 ? -0.2 : 0.3, 0, 0};
      key.weight = kExact;
      solver.add(key);
    }
    solver.solve();
    return Eigen::MatrixXd(kinematics.maps().row(0) * solver.motion());
  };
  const auto change = [&](int rate, Discretisation form) {
    const Eigen::MatrixXd coarse = motion_at(rate / 2, form), fine = motion_at(rate, form);
    double largest = 0;
    for (Eigen::Index i = 0; i < coarse.cols(); ++i)
      largest = std::max(largest, std::abs(coarse(0, i) - fine(0, 2 * i)));
    return largest;
  };
  double last = 0;
  for (const int rate : {24, 48, 96, 192}) {
    const double sampled = change(rate, Discretisation::kSampled),
                 published = change(rate, Discretisation::kDifferences);
    EXPECT_LT(sampled, 0.7 * published) << rate;
    if (last > 0) {
      EXPECT_LT(sampled, 0.6 * last) << rate;
    }
    last = sampled;
  }
}

TEST(SampledModes, AreRefusedWithAMessageWhereTheyAreNone) {
  const auto kinematics = std::make_shared<LinearKinematics>(2, 1, 1.0, 5);
  const auto refused = [&](const ModeDynamics& dynamics) {
    try {
      const Solver solver(kinematics, dynamics, Timeline{20});
    } catch (const Error& error) {
      return error.field();
    }
    return std::string();
  };
  ModeDynamics dynamics = test_dynamics(2, 20, 0.1);
  dynamics.discretisation = Discretisation::kSampled;
  EXPECT_EQ(refused(dynamics), "");
  for (const double smoothing : {-1.0, 2e6, std::nan("")}) {
    dynamics.smoothing = smoothing;
    EXPECT_EQ(refused(dynamics), "dynamics.smoothing");
  }
  dynamics.smoothing = 1e6;
  EXPECT_EQ(refused(dynamics), "");
  dynamics.discretisation = static_cast<Discretisation>(7);
  EXPECT_EQ(refused(dynamics), "dynamics.discretisation");
}

}  // namespace
}  // namespace limber::spacetime
