#include "engine/scene/formats/precision.h"

#include <gtest/gtest.h>

#include "engine/scene/formats/polylines.h"

namespace limber::scene {
namespace {

Eigen::Matrix3Xd unit_segment() {
  Eigen::Matrix3Xd points(3, 2);
  points << 0, 1, 0, 0, 0, 0;
  return points;
}

TEST(PrecisionOfPositions, IsDoubleFarFromTheOrigin) {
  const Eigen::Matrix3Xd near = unit_segment();
  EXPECT_EQ(precision_for(near), Precision::kFloat32);
  EXPECT_TRUE(origin_for(near).isZero(0));
  const Eigen::Vector3d offset(5e5, 4.6e6, 100);
  const Eigen::Matrix3Xd far = near.colwise() + offset;
  EXPECT_EQ(precision_for(far), Precision::kFloat64);
  EXPECT_EQ(origin_for(far), offset + Eigen::Vector3d(0.5, 0, 0));
  EXPECT_EQ(precision_for(Eigen::Matrix3Xd(3, 0)), Precision::kFloat32);
}

TEST(PrecisionOfPositions, SingleLosesLessThanAMillionthOfTheSize) {
  // The farthest place that is still written in single precision.
  for (const double offset : {-8.0, 3.0, 7.0}) {
    const Eigen::Matrix3Xd points = unit_segment().colwise() + Eigen::Vector3d(offset, 0.3, 0.7);
    ASSERT_EQ(precision_for(points), Precision::kFloat32) << offset;
    EXPECT_LT((points.cast<float>().cast<double>() - points).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(PrecisionOfPositions, LinesFarAwayAreWrittenInDouble) {
  Polylines lines;
  lines.points = unit_segment().colwise() + Eigen::Vector3d(0, 5e6, 0);
  lines.lines = {{0, 1}};
  EXPECT_NE(write_vtp(lines).find("type=\"Float64\" Name=\"Points\""), std::string::npos);
  lines.points = unit_segment();
  EXPECT_NE(write_vtp(lines).find("type=\"Float32\" Name=\"Points\""), std::string::npos);
}

}  // namespace
}  // namespace limber::scene
