#include "server/kinds/bodies/frames.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace limber::server {
namespace {

struct Motion {
  session::BodyResult result;
  session::Geometry geometry;
};

/// Numbers that are neither symmetric nor round: rows and columns cannot be mistaken for each
/// other.
Motion make_motion(int nodes, int h, int frames) {
  Motion motion;
  const auto wave = [](double i, double j) { return std::sin(1 + 1.7 * i + 0.3 * j); };
  motion.geometry.rest =
      Eigen::Matrix3Xd::NullaryExpr(3, nodes, [&](auto i, auto j) { return 10 + wave(j, i); });
  motion.geometry.basis = Eigen::MatrixXd::NullaryExpr(3 * nodes, h, [&](auto i, auto j) {
                            return wave(i, j);
                          }).cast<float>();
  motion.geometry.basis_hash = "abc";
  motion.result.coordinates = Eigen::MatrixXd::NullaryExpr(h, frames, [&](auto i, auto j) {
                                return 0.1 * wave(j, i);
                              }).cast<float>();
  motion.result.revision = 4;
  motion.result.report.max_constraint_error = 0.002;
  return motion;
}

Eigen::MatrixXd exact_positions(const Motion& motion, FrameRange range) {
  Eigen::MatrixXd positions =
      motion.geometry.basis.cast<double>() *
      motion.result.coordinates.middleCols(range.first, range.count).cast<double>();
  positions.colwise() +=
      Eigen::Map<const Eigen::VectorXd>(motion.geometry.rest.data(), motion.geometry.rest.size());
  return positions;
}

template <class T>
T at(const proto::Array& array, std::size_t i) {
  T value;
  std::memcpy(&value, array.data().data() + i * sizeof(T), sizeof(T));
  return value;
}

TEST(Frames, CoordinatesAreFramesTimesBasis) {
  const Motion motion = make_motion(5, 3, 7);
  const auto frames =
      encode_frames(motion.result, motion.geometry, proto::ENCODING_UNSPECIFIED, {2, 4}, 0.001);
  EXPECT_EQ(frames.encoding(), proto::ENCODING_COORDINATES);
  EXPECT_EQ(frames.first_frame(), 2u);
  EXPECT_EQ(frames.frame_count(), 4u);
  ASSERT_EQ(frames.data().shape_size(), 2);
  EXPECT_EQ(frames.data().shape(0), 4u);
  EXPECT_EQ(frames.data().shape(1), 3u);
  ASSERT_EQ(frames.data().data().size(), 4u * 3u * 4u);
  EXPECT_EQ(at<float>(frames.data(), 3 * 1 + 2), motion.result.coordinates(2, 3));
  EXPECT_EQ(frames.basis_hash(), "abc");
  EXPECT_EQ(frames.result().revision(), 4u);
  EXPECT_DOUBLE_EQ(frames.result().max_constraint_error(), 2.0);  // metres to millimetres
}

TEST(Frames, PositionsAreFramesTimesNodesTimesThree) {
  const Motion motion = make_motion(5, 3, 7);
  const auto frames =
      encode_frames(motion.result, motion.geometry, proto::ENCODING_POSITIONS, {1, 3}, 1);
  const Eigen::MatrixXd exact = exact_positions(motion, {1, 3});
  ASSERT_EQ(frames.data().data().size(), 3u * 15u * 4u);
  EXPECT_EQ(frames.data().shape(1), 5u);
  for (Eigen::Index f = 0; f < 3; ++f) {
    for (Eigen::Index i = 0; i < 15; ++i) {
      EXPECT_NEAR(
          static_cast<double>(at<float>(frames.data(), static_cast<std::size_t>(15 * f + i))),
          exact(i, f), 2e-6);
    }
  }
}

TEST(Frames, QuantisedPositionsKeepTheErrorTheySay) {
  const Motion motion = make_motion(200, 6, 30);
  const auto frames = encode_frames(motion.result, motion.geometry,
                                    proto::ENCODING_POSITIONS_QUANTISED, {0, 30}, 1);
  const Eigen::MatrixXd exact = exact_positions(motion, {0, 30});
  const double origin[3] = {frames.origin().x(), frames.origin().y(), frames.origin().z()};
  const double extent[3] = {frames.extent().x(), frames.extent().y(), frames.extent().z()};
  const double float_rounding =
      12 * std::pow(2.0, -23);  // of positions near 12, before they are quantised
  double worst = 0;
  for (Eigen::Index f = 0; f < 30; ++f) {
    for (Eigen::Index i = 0; i < 600; ++i) {
      const auto level = at<std::uint16_t>(frames.data(), static_cast<std::size_t>(600 * f + i));
      worst =
          std::max(worst, std::abs(origin[i % 3] + extent[i % 3] * level / 65535.0 - exact(i, f)));
    }
  }
  EXPECT_LE(worst, frames.quantisation_error() + float_rounding);
  EXPECT_GT(worst, 0.8 * frames.quantisation_error());  // the bound says something
}

TEST(Frames, AFlatMotionHasNoExtentAndNoError) {
  Motion motion = make_motion(4, 2, 3);
  motion.geometry.basis.setZero();
  motion.geometry.rest.row(1).setConstant(3);
  const auto frames =
      encode_frames(motion.result, motion.geometry, proto::ENCODING_POSITIONS_QUANTISED, {0, 3}, 1);
  EXPECT_EQ(frames.extent().y(), 0);
  EXPECT_EQ(frames.origin().y(), 3);
  EXPECT_EQ(at<std::uint16_t>(frames.data(), 1), 0);
}

TEST(Frames, SizesAreKnownBeforehand) {
  const Motion motion = make_motion(9, 4, 6);
  for (const auto encoding : {proto::ENCODING_COORDINATES, proto::ENCODING_POSITIONS,
                              proto::ENCODING_POSITIONS_QUANTISED}) {
    EXPECT_EQ(
        encode_frames(motion.result, motion.geometry, encoding, {0, 5}, 1).data().data().size(),
        frames_bytes(encoding, 5, motion.result, motion.geometry));
  }
}

TEST(Frames, RangesOutsideAreRefused) {
  const Motion motion = make_motion(3, 2, 10);
  EXPECT_EQ(frame_range(0, 0, motion.result).count, 10);
  EXPECT_EQ(frame_range(7, 0, motion.result).count, 3);
  const auto field = [&](std::uint32_t first, std::uint32_t count) -> std::string {
    try {
      (void)frame_range(first, count, motion.result);
    } catch (const Refusal& refusal) {
      EXPECT_EQ(refusal.code(), proto::ERROR_CODE_OUT_OF_RANGE);
      return refusal.field();
    }
    return "";
  };
  EXPECT_EQ(field(10, 0), "first_frame");
  EXPECT_EQ(field(9, 2), "frame_count");
  EXPECT_EQ(field(1, 0xffffffffu), "frame_count");
  EXPECT_EQ(field(9, 1), "");
}

}  // namespace
}  // namespace limber::server
