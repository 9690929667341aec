#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/beams/solver/equilibrium.h"
#include "tests/support/beam_problems.h"

// What the solver does where no method is requested: first users' structures, which long load steps
// folded, turned over or called loose.

namespace limber::beams {
namespace {

using Eigen::Vector3d;

constexpr std::array<bool, 6> kHinge{true, true, true, true, false, true};
constexpr std::array<bool, 6> kClamp{true, true, true, true, true, true};

std::array<bool, 6> without_x(std::array<bool, 6> fixed) {
  fixed[0] = false;
  return fixed;
}

PrescribedMotion along_x(int node, double distance) {
  PrescribedMotion motion;
  motion.node = node;
  motion.translates = {true, false, false};
  motion.translation.x() = distance;
  return motion;
}

/// A lath of 1 m x 40 mm x `thickness`, drawn straight and pushed together under its own weight.
struct Lath {
  int elements = 20;
  double push = 0.1;  // [m]
  std::array<bool, 6> ends = kHinge;
  double thickness = 0.003;  // [m]
  double gravity = 9.81;     // [m/s^2]
};
BeamModel lath_model(const Lath& lath) {
  BeamModel model = limber::testing::straight_beam(lath.elements);
  BeamMaterial wood;
  wood.young = 1e10;
  wood.poisson = 0.3;
  wood.density = 600;
  model.sections = {make_section(rectangle(0.04, lath.thickness), wood)};
  model.supports = {{0, lath.ends}, {lath.elements, without_x(lath.ends)}};
  model.motions = {along_x(lath.elements, -lath.push)};
  model.gravity.z() = -lath.gravity;
  return model;
}

TEST(BeamMethodChoice, ALathPushedTogetherUnderItsOwnWeightHangs) {
  std::vector<Lath> laths;
  for (const int elements : {10, 20, 40}) {
    for (const double push : {0.02, 0.1, 0.3}) {
      laths.push_back({elements, push, kHinge});
      laths.push_back({elements, push, kClamp});
    }
  }
  laths.push_back({20, 0.1, kHinge, 0.01});
  laths.push_back({20, 0.1, kHinge, 0.003, 0.1});
  for (const Lath& lath : laths) {
    const BeamSolution found = find_equilibrium(BeamStructure(lath_model(lath)));
    SCOPED_TRACE(found.report.message);
    ASSERT_TRUE(found.report.converged()) << lath.elements << " elements, pushed " << lath.push;
    // An arc that is shorter by p sinks by about 2 sqrt(p) / pi of its length.
    const double sag = -found.state.positions.row(2).minCoeff();
    EXPECT_NEAR(sag, 2 * std::sqrt(lath.push) / std::numbers::pi, 0.1 * std::sqrt(lath.push));
  }
}

TEST(BeamMethodChoice, ARodPulledTautWithASmallCrossLoadIsStraight) {
  for (const int elements : {2, 10, 40}) {
    for (const double pull : {0.0001, 0.005, 0.05, 0.15}) {
      BeamModel model = limber::testing::straight_beam(elements);
      BeamMaterial wood;
      wood.young = 1e10;
      wood.poisson = 0.3;
      model.sections = {make_section(rectangle(0.04, 0.003), wood)};
      model.supports = {{0, kClamp}};
      model.motions = {along_x(elements, pull)};
      model.loads = {{elements, {0, 0, -2}}};
      const BeamSolution found = find_equilibrium(BeamStructure(model));
      ASSERT_TRUE(found.report.converged())
          << elements << " elements, pulled " << pull << ": " << found.report.message;
      EXPECT_NEAR(found.state.positions(0, elements), 1 + pull, 1e-9);
      // The pull carries the load as a string would, with EA pull / L along it.
      const double pulling = 1e10 * 0.04 * 0.003 * pull;
      const double sag = -found.state.positions(2, elements);
      EXPECT_LT(sag, 1.01 * (1 + pull) * 2 / pulling);
      EXPECT_GT(sag, 0.5 * 2 / pulling);  // less where the clamp holds, too
    }
  }
}

TEST(BeamMethodChoice, AnArchStandsOnItsSideHoweverManyElementsItHas) {
  for (const int elements : {10, 20, 30, 60}) {
    BeamModel model = limber::testing::straight_beam(elements, 4);
    for (int i = 0; i <= elements; ++i)
      model.nodes[static_cast<std::size_t>(i)].position.z() =
          0.2 * std::sin(std::numbers::pi * i / elements);
    BeamMaterial glass;
    glass.young = 40e9;
    glass.poisson = 0.3;
    glass.density = 2000;
    model.sections = {make_section(tube(0.01, 0), glass)};
    model.supports = {{0, kHinge}, {elements, without_x(kHinge)}};
    model.motions = {along_x(elements, -0.8)};
    model.gravity.z() = -9.81;
    const BeamSolution found = find_equilibrium(BeamStructure(model));
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    EXPECT_TRUE(found.report.snaps.empty());
    EXPECT_NEAR(found.state.positions.row(2).maxCoeff(), 1.08, 0.02) << elements;
  }
}

/// Between two points 10 m apart, drawn as a parabola; own weight, of the given direction.
BeamModel cable_model(double sag, double weight) {
  constexpr int kElements = 20;
  BeamModel model = limber::testing::straight_beam(kElements, 10);
  for (int i = 0; i <= kElements; ++i) {
    const double x = static_cast<double>(i) / kElements;
    model.nodes[static_cast<std::size_t>(i)].position.z() = -40 * sag * x * (1 - x);
  }
  BeamMaterial steel;
  steel.young = 1.6e11;
  steel.poisson = 0.3;
  steel.density = 7850;
  model.sections = {make_section(tube(0.005, 0), steel)};
  for (BeamElement& e : model.elements) e.kind = BeamKind::kCable;
  model.supports = {{0, {true, true, true}}, {kElements, {true, true, true}}};
  model.gravity.z() = -9.81 * weight;
  return model;
}

TEST(BeamMethodChoice, ACableHangsUnderItsOwnWeight) {
  for (const double sag : {0.02, 0.03, 0.05, 0.07, 0.1, 0.3}) {
    const BeamSolution found = find_equilibrium(BeamStructure(cable_model(sag, 1)));
    ASSERT_TRUE(found.report.converged()) << sag << ": " << found.report.message;
    EXPECT_NEAR(found.state.positions.row(2).minCoeff(), -10 * sag, 0.02 * 10 * sag);
  }
}

TEST(BeamMethodChoice, ACableThatIsLiftedTurnsOver) {
  for (const double sag : {0.02, 0.05, 0.3}) {
    for (const BeamMethod method : {BeamMethod::kChoose, BeamMethod::kRelaxation}) {
      BeamSolveOptions options;
      options.method = method;
      const BeamSolution found = find_equilibrium(BeamStructure(cable_model(sag, -1)), options);
      EXPECT_LT(found.state.positions.cwiseAbs().maxCoeff(), 20) << found.report.message;
      // Going slack and taut may keep the relaxation alone from settling: that is no balance then.
      if (method == BeamMethod::kChoose) {
        ASSERT_TRUE(found.report.converged()) << sag << ": " << found.report.message;
      } else {
        ASSERT_TRUE(found.report.converged() || found.report.status == BeamStatus::kStalled)
            << sag << ": " << found.report.message;
      }
      EXPECT_NEAR(found.state.positions.row(2).maxCoeff(), 10 * sag, 0.02 * 10 * sag);
    }
  }
}

TEST(BeamMethodChoice, ASlackCableHangs) {
  BeamModel model = cable_model(0, 1);
  for (BeamElement& e : model.elements) e.rest_length = 0.51;
  for (const BeamMethod method : {BeamMethod::kChoose, BeamMethod::kRelaxation}) {
    BeamSolveOptions options;
    options.method = method;
    const BeamSolution found = find_equilibrium(BeamStructure(model), options);
    ASSERT_TRUE(found.report.converged()) << found.report.message;
    // A parabola longer by 2 %: sag^2 = 3/8 0.02 of the span.
    EXPECT_NEAR(found.state.positions.row(2).minCoeff(), -10 * std::sqrt(0.0075), 0.03);
  }
}

}  // namespace
}  // namespace limber::beams
