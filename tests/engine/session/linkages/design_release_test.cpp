#include "engine/session/linkages/design_release.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/rods/design/shape_functions.h"
#include "engine/rods/equilibrium/deployment.h"
#include "tests/engine/rods/linkage/small_linkages.h"

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

TEST(DesignRelease, NothingIsReportedWhereItClosesFlat) {
  const Opened opened;
  EXPECT_EQ(describe_release(opened.model, opened.flat, opened.deployed, opened.point, {}), "");
}

TEST(DesignRelease, AnotherFlatShapeIsReportedWithItsEnergyAndAngle) {
  Opened opened;
  rods::Conditions elsewhere = opened.flat;
  elsewhere.mean_opening_angle = opened.point.flat.mean_opening_angle() - 0.1;
  rods::LinkageEquilibrium equilibrium(opened.model);
  ASSERT_EQ(rods::deploy(equilibrium, opened.point.flat, opened.flat, elsewhere).status,
            rods::DeploymentStatus::kReached);
  const std::string remark =
      describe_release(opened.model, opened.flat, opened.deployed, opened.point, {});
  EXPECT_NE(remark.find("does not fall to the flat one"), std::string::npos) << remark;
  EXPECT_NE(remark.find("times its energy"), std::string::npos) << remark;
}

TEST(DesignRelease, CancelledItSaysNothing) {
  const Opened opened;
  JobContext job;
  job.cancellation.request();
  EXPECT_EQ(describe_release(opened.model, opened.flat, opened.deployed, opened.point, job), "");
}

TEST(DesignRelease, AFlatShapeAsHighAsTheDeployedOneIsReported) {
  Opened opened;
  const double size = 120;
  EXPECT_EQ(describe_flatness(opened.model, opened.point, size), "") << "it opens within a plane";
  opened.point.flat = opened.point.deployed = rods::LinkageState(opened.model);  // as drawn: a wave
  const std::string remark = describe_flatness(opened.model, opened.point, size);
  EXPECT_EQ(remark.find("the shape that is to be flat is not: its height is "), 0U) << remark;
  EXPECT_EQ(describe_flatness(opened.model, opened.point, 100 * size), "")
      << "a height of less than a hundredth";
}

TEST(DesignRelease, AFlatShapeThatSpringsUpIsReported) {
  Opened opened;
  EXPECT_EQ(describe_springing_up(opened.model, opened.flat, opened.point, 120, {}), "")
      << "nothing holds it";
  // Rods that are longest in the middle of their grid, which rises by that at any angle.
  rods::LinkageModel tall = rods::testing::grid_model(6, 6, 1.5);
  Eigen::VectorXd lengths = tall.segment_lengths();
  for (Eigen::Index s = 0; s < lengths.size(); ++s) {
    const rods::Segment& segment = tall.graph().segments[static_cast<std::size_t>(s)];
    const Eigen::Vector3d at = 0.5 * (segment.points[0] + segment.points[1]);
    lengths[s] *= 1.15 - 2e-5 * (at - Eigen::Vector3d(100, 100, 0)).squaredNorm();
  }
  tall.set_segment_lengths(lengths);
  rods::LinkageEquilibrium equilibrium(tall);
  rods::DesignPoint point{
      tall.segment_lengths(), rods::LinkageState(tall), rods::LinkageState(tall), {}, {}};
  rods::Conditions held;
  held.pins = {{14}};
  rods::Conditions open = held, closed = held;
  open.mean_opening_angle = 1.3;
  closed.mean_opening_angle = 0.1;  // almost closed it is lower
  const auto go = [&](rods::LinkageState& state, const rods::Conditions& from,
                      const rods::Conditions& to) {
    ASSERT_EQ(rods::deploy(equilibrium, state, from, to).status, rods::DeploymentStatus::kReached);
  };
  go(point.flat, {}, open);
  rods::LinkageState free = point.flat;
  go(free, open, held);
  go(point.flat, open, closed);
  const auto height = [&](const rods::LinkageState& state) {
    return std::sqrt(rods::Flatness(tall).value(state) / 36);
  };
  ASSERT_GT(height(free), 1.1 * height(point.flat));
  // A size of which a hundredth lies between both.
  const double size = 100 * std::sqrt(height(free) * height(point.flat));
  const std::string remark = describe_springing_up(tall, closed, point, size, {});
  EXPECT_EQ(remark.find("held at its mean angle of 5.7 degrees the linkage is flat, released it"),
            0U)
      << remark;
  EXPECT_EQ(describe_springing_up(tall, closed, point, 2 * size, {}), "")
      << "as flat when released";
  EXPECT_EQ(describe_springing_up(tall, closed, point, size / 2, {}), "")
      << "not flat to begin with";
  JobContext job;
  job.cancellation.request();
  EXPECT_EQ(describe_springing_up(tall, closed, point, size, job), "");
}

TEST(DesignRelease, ADeployedShapeInAPlaneIsReported) {
  Opened opened;
  EXPECT_NE(describe_plane(opened.model, opened.point, 120).find("is planar"), std::string::npos);
  opened.point.deployed = rods::LinkageState(opened.model);
  EXPECT_EQ(describe_plane(opened.model, opened.point, 120), "");
}

}  // namespace
}  // namespace limber::session
