#include "server/kinds/bodies/result.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

TEST(ResultCodec, LengthsComeInTheScenesUnit) {
  session::BodyResult result;
  result.report.max_constraint_error = 0.002;
  result.report.rms_constraint_error = 0.001;
  result.report.max_exact_error = 0.0005;
  result.report.max_velocity_error = 0.003;  // per frame
  result.report.max_exact_velocity_error = 0.001;
  result.frames_per_second = 25;
  const proto::ResultInfo info = encode_result(result, 0.001);
  EXPECT_DOUBLE_EQ(info.max_constraint_error(), 2);
  EXPECT_DOUBLE_EQ(info.rms_constraint_error(), 1);
  EXPECT_DOUBLE_EQ(info.max_exact_error(), 0.5);
  EXPECT_DOUBLE_EQ(info.max_velocity_error(), 75);  // a second
  EXPECT_DOUBLE_EQ(info.max_exact_velocity_error(), 25);
  EXPECT_FALSE(info.solve_failed());
}

TEST(ResultCodec, TheErrorOfAMotionComesInTheScenesUnit) {
  session::BodyResult result;
  EXPECT_FALSE(encode_result(result, 0.001).has_motion_error());
  session::MotionCheck check;
  check.error.shape_error = 0.03;
  check.error.max_distance = 0.004;
  check.error.max_constraint_error = 0.002;
  check.error.inverted_tets = 7;
  check.error.inverted_frame = 40;
  check.error.max_velocity_error = 0.001;
  check.frames_per_second = 25;
  check.length = 0.5;
  check.tolerance = 0.01;
  result.motion_check = std::make_shared<const session::MotionCheck>(check);
  const proto::ResultInfo info = encode_result(result, 0.001);
  EXPECT_DOUBLE_EQ(info.motion_error().shape_error(), 0.03);
  EXPECT_DOUBLE_EQ(info.motion_error().max_distance(), 4);
  EXPECT_DOUBLE_EQ(info.motion_error().max_distance_share(), 0.008);
  EXPECT_DOUBLE_EQ(info.motion_error().max_constraint_error(), 2);
  EXPECT_DOUBLE_EQ(info.motion_error().max_velocity_error(), 25);
  EXPECT_EQ(info.motion_error().inverted_tets(), 7u);
  EXPECT_EQ(info.motion_error().inverted_frame(), 40u);
  EXPECT_FALSE(info.motion_error().within_tolerance());
}

TEST(ResultCodec, AFailedSolveIsMarked) {
  session::BodyResult result;
  result.is_final = true;
  result.solve_failed = true;
  result.report.status = spacetime::SolveStatus::kStalled;
  result.report.message = "the solve failed: because";
  const proto::ResultInfo info = encode_result(result, 1);
  EXPECT_TRUE(info.solve_failed());
  EXPECT_TRUE(info.converged());
  EXPECT_EQ(info.status(), proto::SOLVE_STATUS_STALLED);
  EXPECT_EQ(info.message(), "the solve failed: because");
}

}  // namespace
}  // namespace limber::server
