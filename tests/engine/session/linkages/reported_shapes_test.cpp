// What is reported of a shape is of that shape, and converged shapes are where they stay.

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/degrees.h"
#include "engine/rods/linkage/joint_positions.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "engine/session/linkages/live_linkage.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session {
namespace {

using testing::hyperboloid;
using testing::LiveSession;

double energy_of(const rods::LinkageModel& model, const rods::LinkageState& state) {
  return rods::LinkageAssembly(model).energies(state).total();
}

TEST(ReportedShapes, LengthsAreReachedWhereTheOtherRequestsAreNot) {
  LiveSession live(hyperboloid());
  const auto was = live.edit({SetMeanAngle{40 * kDegree}});
  ASSERT_TRUE(was && !was->solve_failed);
  Eigen::VectorXd lengths = was->statics->model().segment_lengths();
  for (Eigen::Index s = 0; s < lengths.size(); ++s)
    lengths[s] *= 1 + 0.1 * std::sin(3.0 * static_cast<double>(s));
  const auto is =  // nothing holds it against the force
      live.edit({SetSegmentLengths{lengths}, SetJointLoad{{5, Eigen::Vector3d(0, 0, 100)}}});
  ASSERT_TRUE(is && is->solve_failed);
  ASSERT_EQ(is->statics->model().segment_lengths(), lengths);
  const double energy = energy_of(is->statics->model(), *is->state);
  EXPECT_NEAR(is->report.energies.total(), energy, 1e-6 * energy);
  EXPECT_GT(energy, 2 * was->report.energies.total());
}

/// The same lengths, of edges in place of segments, and back.
TEST(ReportedShapes, SizesThatChangeNothingKeepTheEnergy) {
  LiveSession live(hyperboloid());
  const auto was = live.edit({SetMeanAngle{40 * kDegree}});
  ASSERT_TRUE(was && !was->solve_failed);
  const auto is = live.edit({SetEdgeLengths{was->statics->model().edge_lengths()},
                             SetJointLoad{{5, Eigen::Vector3d(0, 0, 100)}}});
  ASSERT_TRUE(is && is->solve_failed);
  const double energy = was->report.energies.total();
  EXPECT_NEAR(is->report.energies.total(), energy, 1e-6 * energy);
}

/// A floating part turns by any angle along the path; its rods keep their twists.
TEST(ReportedShapes, FarOpenedAndBackTheEnergyIsThatOfTheShape) {
  LiveLinkage live(hyperboloid());
  const auto go_to = [&](double degrees) {
    auto conditions = std::make_shared<scene::LinkageConditions>();
    conditions->mean_angle = degrees * kDegree;
    return live.solve(conditions, {}, [] {});
  };
  for (const double degrees : {60, 100, 130, 150, 165, 100, 60}) {
    const LiveLinkage::Outcome outcome = go_to(degrees);
    ASSERT_TRUE(outcome.reached) << degrees << ": " << outcome.report.message;
    const double energy = energy_of(live.model(), live.state());
    EXPECT_NEAR(outcome.report.energies.total(), energy, 1e-6 * energy) << degrees;
  }
}

/// The sample's branch loses its stability at 104 degrees, hardly: the directions in which it sways
/// beyond have next to no curvature, less than what balance leaves of the forces might take.
TEST(ReportedShapes, WhereStabilityIsHardlyLostConvergedShapesAreStable) {
  for (const double degrees : {103.6, 104.05, 104.5, 105.0}) {
    const scene::Linkage sample = scene::make_linkage_sample("hyperboloid");
    LiveLinkage live(sample);
    const auto with = [&](double torque) {
      auto conditions = std::make_shared<scene::LinkageConditions>(sample.conditions);
      conditions->mean_angle = degrees * kDegree;
      if (torque != 0) conditions->loads = {{0, {0, 0, 0}, {0, 0, 0}, torque}};
      return live.solve(conditions, {}, [] {});
    };
    const LiveLinkage::Outcome first = with(0);
    ASSERT_TRUE(first.reached) << first.report.message;
    const Eigen::Matrix3Xd joints = rods::joint_positions(live.state());
    ASSERT_TRUE(with(1e-4).reached);
    const LiveLinkage::Outcome again = with(0);
    ASSERT_TRUE(again.reached) << again.report.message;
    EXPECT_NEAR(again.report.energies.total(), first.report.energies.total(), 1e-9);
    EXPECT_LT((rods::joint_positions(live.state()) - joints).cwiseAbs().maxCoeff(), 1e-4);
  }
}

}  // namespace
}  // namespace limber::session
