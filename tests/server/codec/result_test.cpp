#include "server/codec/result.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

TEST(ResultCodec, LengthsComeInTheScenesUnit) {
  session::Result result;
  result.report.max_constraint_error = 0.002;
  result.report.rms_constraint_error = 0.001;
  result.report.max_exact_error = 0.0005;
  const proto::ResultInfo info = encode_result(result, 0.001);
  EXPECT_DOUBLE_EQ(info.max_constraint_error(), 2);
  EXPECT_DOUBLE_EQ(info.rms_constraint_error(), 1);
  EXPECT_DOUBLE_EQ(info.max_exact_error(), 0.5);
  EXPECT_FALSE(info.solve_failed());
}

TEST(ResultCodec, AFailedSolveIsMarked) {
  session::Result result;
  result.converged = true;
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
