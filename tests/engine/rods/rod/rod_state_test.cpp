#include "engine/rods/rod/rod_state.h"

#include <gtest/gtest.h>

#include <numbers>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "tests/engine/rods/rod/rod_samples.h"

namespace limber::rods {
namespace {

using namespace limber::rods::testing;

TEST(RodState, MovingTheSourceKeepsFramesStrainsAndEnergy) {
  const Sample s = sample({7, 4}, k2008);
  const RodState state = s.state();
  const RodAtSource at(state);
  const RodState again = at.moved(s.unknowns);  // transported from the new source, by nothing
  EXPECT_EQ(at.state().energy(s.parameters), state.energy(s.parameters));
  EXPECT_NEAR(again.energy(s.parameters), state.energy(s.parameters),
              1e-13 * state.energy(s.parameters));
  for (int slot = 0; slot < s.layout->nodes(); ++slot) {
    if (!s.layout->is_edge(slot)) continue;
    EXPECT_LT(norm(again.frame(slot).d1 - state.frame(slot).d1), 2e-15);
    EXPECT_LT(norm(again.frame(slot).transport), 1e-15);
    EXPECT_GT(norm(state.frame(slot).transport), 1e-3);
    if (!s.layout->is_interior(slot)) continue;
    EXPECT_NEAR(again.strains(slot).twist, state.strains(slot).twist, 1e-14);
  }
}

TEST(RodState, EvaluationsLeaveItAsItIs) {
  const Sample s = sample({7}, k2008);
  const RodAtSource at = s.at_source();
  const RodState state = at.moved(s.unknowns);
  const double energy = state.energy(s.parameters);
  const Eigen::VectorXd gradient = state.gradient(s.parameters);
  (void)RodAtSource(state);
  (void)at.hessian(s.parameters);
  (void)at.moved(s.unknowns + Eigen::VectorXd::Constant(s.layout->unknowns(), 0.01));
  EXPECT_EQ(state.energy(s.parameters), energy);
  EXPECT_EQ(state.gradient(s.parameters), gradient);
}

TEST(RodState, TwistContinuesPastPi) {
  // One edge of a rod turned five times about itself in small steps, with the source moved along.
  const auto layout = std::make_shared<const RodLayout>(std::vector<int>{2});
  Eigen::VectorXd x(12);
  x << 0, 0, 0, 0, 1, 0, 0, 0, 2, 0.1, 0, 0;
  const auto source = std::make_shared<const SourceFrames>(
      SourceFrames::without_twist(*layout, x, Eigen::Matrix3Xd::Zero(3, 1)));
  RodAtSource at(RodState(layout, source, x));
  for (int step = 1; step <= 40; ++step) {
    x[7] = step * std::numbers::pi / 4;
    at = RodAtSource(at.moved(x));
    EXPECT_NEAR(at.state().strains(1).twist, x[7], 1e-12);
  }
  // The same rotation of the frame by carrying the tangent round a loop: holonomy, with no change
  // of any angle, is counted as well.
  const double before = at.state().strains(1).twist;
  const double opening = 0.6;
  double previous = before;
  for (int turn = 0; turn < 3; ++turn) {
    for (int step = 1; step <= 60; ++step) {
      const double phi = 2 * std::numbers::pi * step / 60;
      x.segment<3>(8) << 1 + std::cos(opening), std::sin(opening) * std::cos(phi),
          std::sin(opening) * std::sin(phi);
      at = RodAtSource(at.moved(x));
      EXPECT_LT(std::abs(at.state().strains(1).twist - previous), 0.5);
      previous = at.state().strains(1).twist;
    }
  }
  // Three times the solid angle, less what the vertex's own transport takes away: a frame carried
  // parallel from the fixed edge before it stays put, so all of the loop's solid angle shows. The
  // loop is a polygon of 60 sides; its first closing side starts from the old direction.
  EXPECT_NEAR(std::abs(previous - before), 3 * 2 * std::numbers::pi * (1 - std::cos(opening)),
              0.05);
}

TEST(RodState, ResultsDoNotDependOnThreads) {
  const Sample s = sample({900, 700, 500}, k2008);
  std::vector<Eigen::VectorXd> gradients;
  std::vector<SlotArray> hessians;
  std::vector<double> energies;
  const int threads = thread_count();
  for (const int count : {1, 2, 5}) {
    set_thread_count(count);
    const RodState state = s.state();
    energies.push_back(state.energy(s.parameters));
    gradients.push_back(state.gradient(s.parameters));
    hessians.push_back(RodAtSource(state).hessian(s.parameters).values());
  }
  set_thread_count(threads);
  for (std::size_t i = 1; i < gradients.size(); ++i) {
    EXPECT_EQ(energies[i], energies[0]);
    EXPECT_EQ(gradients[i], gradients[0]);
    EXPECT_EQ(hessians[i].topRows(s.layout->nodes()), hessians[0].topRows(s.layout->nodes()));
  }
}

TEST(RodState, NeighboursInTheLayoutMayLieAnyHow) {
  // Rods that end where the next begins, or fold back onto it: nothing of that may leak into them.
  const auto layout = std::make_shared<const RodLayout>(std::vector<int>{2, 2, 2});
  Eigen::VectorXd x(layout->unknowns());
  x.setZero();
  const Eigen::Vector3d nodes[9] = {{0, 0, 0}, {1, 0, 0}, {2, 0.1, 0}, {2, 0.1, 0}, {1, 0, 0},
                                    {0, 0, 0}, {0, 0, 0}, {1, 0, 0},   {2, 0.1, 0}};
  for (int i = 0; i < 9; ++i) x.segment<3>(4 * i) = nodes[i];
  const auto source = std::make_shared<const SourceFrames>(
      SourceFrames::without_twist(*layout, x, Eigen::Matrix3Xd::Zero(3, 3)));
  RodParameters p(*layout);
  for (int slot = 0; slot < 9; ++slot) {
    if (layout->is_edge(slot)) p(slot, RodParameters::kRestLength) = 0.9;
    for (const auto k : {RodParameters::kStretching, RodParameters::kBending1,
                         RodParameters::kBending2, RodParameters::kTorsion})
      p(slot, k) = 2;
  }
  const RodAtSource at(RodState(layout, source, x));
  EXPECT_TRUE(at.state().is_finite());
  EXPECT_TRUE(at.state().gradient(p).allFinite());
  EXPECT_TRUE(banded(*layout, at.hessian(p)).allFinite());
  EXPECT_GT(at.state().energy(p), 0);
}

TEST(RodState, FoldedBackOrEmptyEdgesAreReported) {
  const Sample s = sample({4}, k2008);
  Eigen::VectorXd folded = s.unknowns;
  folded.segment<3>(8) = folded.segment<3>(0);  // node 2 on node 0: edge 1 back along edge 0
  const RodState state(s.layout, s.source, folded);
  EXPECT_FALSE(state.is_finite() && std::isfinite(state.energy(s.parameters)) &&
               state.energy(s.parameters) < 1e12);
  Eigen::VectorXd empty = s.unknowns;
  empty.segment<3>(8) = empty.segment<3>(4);
  EXPECT_FALSE(RodState(s.layout, s.source, empty).is_finite());
  EXPECT_THROW(RodAtSource(RodState(s.layout, s.source, empty)), Error);
  const Eigen::Matrix3Xd none = Eigen::Matrix3Xd::Zero(3, 1);
  try {
    (void)SourceFrames::without_twist(*s.layout, empty, none);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "rods[0].edges[1]");
  }
  try {
    (void)SourceFrames::without_twist(*s.layout, folded, none);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "rods[0].vertices[1]");
  }
  try {
    Eigen::Matrix3Xd along(3, 1);
    along.col(0) = s.unknowns.segment<3>(4) - s.unknowns.segment<3>(0);
    (void)SourceFrames::without_twist(*s.layout, s.unknowns, along);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "rods[0].edges[0].director");
  }
  EXPECT_THROW(RodLayout({3, 0}), Error);
}

TEST(RodState, ParametersThatCannotBeAreNamed) {
  const Sample s = sample({4, 3}, k2008);
  s.parameters.validate(*s.layout);
  RodParameters bad = s.parameters;
  bad(6, RodParameters::kBending2) = -1;  // rod 1, vertex 1
  try {
    bad.validate(*s.layout);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "rods[1].vertices[1].bending_2");
  }
}

}  // namespace
}  // namespace limber::rods
