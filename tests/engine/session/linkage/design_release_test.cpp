#include "engine/session/linkage/design_release.h"

#include <gtest/gtest.h>

#include "engine/rods/equilibrium/deployment.h"
#include "tests/engine/rods/equilibrium/small_linkages.h"

namespace limber::session {
namespace {

/// Free, and opened by its mean angle; both keep a joint in place.
struct Opened {
  rods::LinkageModel model = rods::testing::curved_model();
  rods::Conditions flat, deployed;
  rods::DesignPoint point{
      model.segment_lengths(), rods::LinkageState(model), rods::LinkageState(model), {}, {}};

  Opened() {
    flat.pins = deployed.pins = {{5}};
    rods::LinkageEquilibrium equilibrium(model);
    EXPECT_TRUE(equilibrium.solve(point.flat, flat).converged());
    point.deployed = point.flat;
    deployed.mean_opening_angle = point.flat.mean_opening_angle() + 0.3;
    EXPECT_EQ(rods::deploy(equilibrium, point.deployed, flat, deployed).status,
              rods::DeploymentStatus::kReached);
  }
};

TEST(DesignRelease, NothingIsSaidWhereItFallsFlat) {
  const Opened opened;
  EXPECT_EQ(told_release(opened.model, opened.flat, opened.deployed, opened.point, {}), "");
}

TEST(DesignRelease, AnotherFlatShapeIsToldWithItsEnergyAndAngle) {
  Opened opened;
  rods::Conditions elsewhere = opened.flat;
  elsewhere.mean_opening_angle = opened.point.flat.mean_opening_angle() - 0.1;
  rods::LinkageEquilibrium equilibrium(opened.model);
  ASSERT_EQ(rods::deploy(equilibrium, opened.point.flat, opened.flat, elsewhere).status,
            rods::DeploymentStatus::kReached);
  const std::string told =
      told_release(opened.model, opened.flat, opened.deployed, opened.point, {});
  EXPECT_NE(told.find("does not fall to the flat one"), std::string::npos) << told;
  EXPECT_NE(told.find("times its energy"), std::string::npos) << told;
}

TEST(DesignRelease, CancelledItSaysNothing) {
  const Opened opened;
  JobContext job;
  job.cancellation.request();
  EXPECT_EQ(told_release(opened.model, opened.flat, opened.deployed, opened.point, job), "");
}

TEST(DesignRelease, AFlatShapeAsHighAsTheDeployedOneIsTold) {
  Opened opened;
  const double size = 120;
  EXPECT_EQ(told_flatness(opened.model, opened.point, size), "") << "it opens within a plane";
  opened.point.flat = opened.point.deployed = rods::LinkageState(opened.model);  // as drawn: a wave
  const std::string told = told_flatness(opened.model, opened.point, size);
  EXPECT_EQ(told.find("the shape without angles is not flat: its height is "), 0U) << told;
  EXPECT_EQ(told_flatness(opened.model, opened.point, 100 * size), "")
      << "a height of less than a hundredth";
}

}  // namespace
}  // namespace limber::session
