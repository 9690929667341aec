// Equilibria that may rest in any direction about an axis, and mechanisms that do move freely.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_columns.h"
#include "tests/support/beam_problems.h"
#include "tests/support/independent_beam_energy.h"

namespace limber::beams {
namespace {

using Eigen::Vector3d;
using limber::testing::clamped;
using limber::testing::straight_beam;

constexpr int kRodElements = 12;
constexpr int kRodMiddle = kRodElements / 2;

PrescribedMotion pushed_end(int node, double push) {
  PrescribedMotion motion;
  motion.node = node;
  motion.translates = {true, true, true};
  motion.rotates = {true, true, true};
  motion.translation = {-push, 0, 0};
  return motion;
}

NodalLoad push_at(int node, const Vector3d& force) {
  NodalLoad load;
  load.node = node;
  load.force = force;
  return load;
}

/// Unit length along x, clamped at both ends, one brought in; bends alike in all directions.
BeamModel round_rod(double push) {
  BeamModel model = straight_beam(kRodElements, 1, 200);
  model.supports = {clamped(0)};
  model.motions = {pushed_end(kRodElements, push)};
  return model;
}

BeamModel square_rod(double push) {
  BeamModel model = round_rod(push);
  model.sections[0].torsion *= 0.843;  // 0.1406 a^4 over a^4 / 6
  return model;
}

/// Height of the arch where it bends in one plane only: sections ten times as stiff about the other
/// axis.
double height_in_plane(double push) {
  BeamModel model = round_rod(push);
  model.sections[0].bending_3 *= 10;
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  EXPECT_TRUE(found.report.converged()) << found.report.message;
  return std::abs(found.state.positions(2, kRodMiddle));
}

Vector3d rise(const BeamSolution& found, int node = kRodMiddle) {
  Vector3d position = found.state.positions.col(node);
  position.x() = 0;
  return position;
}

BeamSolution solved_rod(const BeamModel& model, BeamMethod method = BeamMethod::kChoose) {
  BeamSolveOptions options;
  options.method = method;
  return find_equilibrium(BeamStructure(model), options);
}

/// It moves across the arch, and about the line between its ends.
void expect_arch(const BeamSolution& found, double height) {
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  EXPECT_NEAR(rise(found).norm(), height, 1e-6);
  EXPECT_EQ(found.report.negative_eigenvalues, 0);
  ASSERT_EQ(found.report.neutral_directions.size(), 1) << found.report.message;
  const BeamNeutralDirection& neutral = found.report.neutral_directions[0];
  EXPECT_EQ(neutral.node, kRodMiddle);
  EXPECT_NEAR(std::abs(neutral.translation.normalized().dot(
                  rise(found).cross(Vector3d::UnitX()).normalized())),
              1, 1e-6);
  EXPECT_NE(found.report.message.find("neutral"), std::string::npos) << found.report.message;
}

TEST(BeamNeutralDirections, ARoundRodPushedIntoAnArchRestsInAnyPlane) {
  const double height = height_in_plane(0.1);
  for (const BeamMethod method :
       {BeamMethod::kChoose, BeamMethod::kNewton, BeamMethod::kRelaxationThenNewton}) {
    SCOPED_TRACE(to_string(method));
    expect_arch(solved_rod(round_rod(0.1), method), height);
    expect_arch(solved_rod(square_rod(0.1), method), height);
  }
}

TEST(BeamNeutralDirections, APushChoosesThePlane) {
  const double height = height_in_plane(0.1);
  for (const Vector3d& side :
       {Vector3d(0, 0, 1), Vector3d(0, 1, 0), Vector3d(0, 0.6, -0.8), Vector3d(0, -1, 0)}) {
    for (const double size : {1e-3, 1.0}) {
      BeamModel model = round_rod(0.1);
      model.temporary_loads = {push_at(kRodMiddle, size * side)};
      const BeamSolution found = solved_rod(model);
      expect_arch(found, height);
      EXPECT_NEAR(rise(found).normalized().dot(side), 1, 1e-6) << size << ": " << side.transpose();
    }
  }
}

/// As sessions do it, edit after edit.
class LiveRod {
 public:
  explicit LiveRod(const BeamModel& model) : state_(BeamStructure(model).rest_state()) {}

  BeamSolution go_to(const BeamModel& model) {
    const BeamStructure structure(model);
    BeamSolution found =
        follow_equilibrium(structure, state_, {}, BeamSolveOptions::live(structure.elements()));
    if (found.report.converged()) state_ = found.state;
    return found;
  }

 private:
  BeamState state_;
};

TEST(BeamNeutralDirections, EditsGoOnInThePlaneThatAPushChose) {
  const Vector3d side(0, 0.6, 0.8);
  LiveRod rod(round_rod(0));
  BeamModel first = round_rod(0.05);
  first.temporary_loads = {push_at(kRodMiddle, 0.1 * side)};
  expect_arch(rod.go_to(first), height_in_plane(0.05));
  for (const double push : {0.1, 0.15, 0.3, 0.2, 0.02, 0.1}) {
    SCOPED_TRACE(push);
    const BeamSolution found = rod.go_to(round_rod(push));
    expect_arch(found, height_in_plane(push));
    EXPECT_NEAR(rise(found).normalized().dot(side), 1, 1e-6);
    EXPECT_TRUE(found.report.snaps.empty());
  }
}

/// A side load of any size brings the arch into its plane; without it the arch stays there.
TEST(BeamNeutralDirections, ALoadAcrossTurnsTheArchAndLeavesItThere) {
  LiveRod rod(round_rod(0));
  BeamModel first = round_rod(0.1);
  first.temporary_loads = {push_at(kRodMiddle, {0, 0, 0.1})};
  ASSERT_TRUE(rod.go_to(first).report.converged());
  BeamModel loaded = round_rod(0.1);
  loaded.loads = {push_at(kRodMiddle, {0, 0.5, 0})};
  const BeamSolution across = rod.go_to(loaded);
  ASSERT_TRUE(across.report.converged()) << across.report.message;
  EXPECT_TRUE(across.report.neutral_directions.empty()) << across.report.message;
  EXPECT_NEAR(rise(across).normalized().y(), 1, 1e-6);
  const BeamSolution left = rod.go_to(round_rod(0.1));
  expect_arch(left, height_in_plane(0.1));
  EXPECT_NEAR(rise(left).normalized().y(), 1, 1e-5);
}

/// Clamped at its foot; 16 elements of equal bending stiffnesses.
TEST(BeamNeutralDirections, ATubeColumnBeyondItsEulerLoadBendsAsTheElasticaDoes) {
  for (const double load : {1.02, 1.5}) {
    BeamModel model = straight_beam(16, 1, 200);
    model.supports = {clamped(0)};
    model.loads = {push_at(16, {-load * 2.4674011, 0, 0})};
    const BeamSolution found = solved_rod(model);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    const double known =
        limber::testing::elastica_deflection({limber::testing::ColumnEnds::kClampedFree, 16, load});
    EXPECT_NEAR(rise(found, 16).norm(), known, (load < 1.1 ? 0.01 : 0.001) * known);
    EXPECT_EQ(found.report.neutral_directions.size(), 1) << found.report.message;
    EXPECT_EQ(found.report.negative_eigenvalues, 0);
    EXPECT_TRUE(found.report.snaps.empty());
    EXPECT_EQ(limber::testing::negative_by_independent_energy(BeamStructure(model), found.state),
              0);
  }
}

/// A second rod, not connected with the first.
void add_rod(BeamModel& model, const BeamModel& other, double aside) {
  const int first = static_cast<int>(model.nodes.size());
  for (BeamNode node : other.nodes) {
    node.position.y() += aside;
    model.nodes.push_back(node);
  }
  for (BeamElement element : other.elements) {
    element.start += first;
    element.finish += first;
    model.elements.push_back(element);
  }
  for (BeamSupport support : other.supports) {
    support.node += first;
    model.supports.push_back(support);
  }
  for (PrescribedMotion motion : other.motions) {
    motion.node += first;
    model.motions.push_back(motion);
  }
}

TEST(BeamNeutralDirections, TwoRodsHaveTwo) {
  BeamModel model = round_rod(0.1);
  add_rod(model, round_rod(0.2), 3);
  const BeamSolution found = solved_rod(model);
  ASSERT_TRUE(found.report.converged()) << found.report.message;
  ASSERT_EQ(found.report.neutral_directions.size(), 2) << found.report.message;
  EXPECT_EQ(found.report.negative_eigenvalues, 0);
}

/// Ends on ball joints: it turns about the line between them, bent or not.
BeamModel rod_on_balls(double push) {
  BeamModel model = round_rod(push);
  model.supports[0].fixed = {true, true, true, false, false, false};
  model.motions[0].rotates = {false, false, false};
  return model;
}

TEST(BeamNeutralDirections, WhatTurnsFreelyIsAMechanismStill) {
  EXPECT_EQ(solved_rod(rod_on_balls(0)).report.status, BeamStatus::kMechanism);
  const BeamSolution bent = solved_rod(rod_on_balls(0.1));
  EXPECT_EQ(bent.report.status, BeamStatus::kMechanism) << bent.report.message;
  EXPECT_TRUE(bent.report.neutral_directions.empty());
  // A chain of links, two of them: their joint moves across without any force.
  BeamModel chain = straight_beam(2, 1, 200);
  chain.supports = {clamped(0), clamped(2)};
  for (BeamElement& link : chain.elements)
    link.start_release.rotations = link.finish_release.rotations = {false, true, true};
  EXPECT_EQ(solved_rod(chain).report.status, BeamStatus::kMechanism);
}

TEST(BeamNeutralDirections, AMechanismBesideANeutralDirectionIsReported) {
  BeamModel model = round_rod(0.1);
  add_rod(model, rod_on_balls(0), 3);
  EXPECT_EQ(solved_rod(model).report.status, BeamStatus::kMechanism);
}

}  // namespace
}  // namespace limber::beams
