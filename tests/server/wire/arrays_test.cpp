#include "server/wire/arrays.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/server/support/scenes.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

proto::Array array_of(proto::DataType type, std::initializer_list<std::uint64_t> shape,
                      std::string data) {
  proto::Array array;
  array.set_type(type);
  for (const auto extent : shape) array.add_shape(extent);
  array.set_data(std::move(data));
  return array;
}

std::string field_of(const std::function<void()>& decode) {
  try {
    decode();
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
    return refusal.field();
  }
  return "accepted";
}

TEST(Arrays, PointsOfBothPrecisionsComeBack) {
  Eigen::Matrix3Xd points(3, 2);
  points << 1, 2, 3, 4, 5.5, 6;
  EXPECT_EQ(decode_points(encode_points(points), "a"), points);
  points(0, 0) = 0.1;  // no float32
  EXPECT_EQ(decode_points(encode_points_float64(points), "a"), points);
  EXPECT_NEAR((decode_points(encode_points(points), "a") - points).norm(), 0, 1e-8);
}

TEST(Arrays, RowsAreTheOuterIndex) {
  const auto array = array_of(proto::DATA_TYPE_INT32, {2, 4},
                              bytes_of(std::vector<std::int32_t>{1, 2, 3, 4, 5, 6, 7, 8}));
  const auto tets = decode_tets(array, "t");
  EXPECT_EQ(tets.col(1), Eigen::Vector4i(5, 6, 7, 8));
  EXPECT_EQ(encode_indices(tets).SerializeAsString(), array.SerializeAsString());
}

TEST(Arrays, BytesMustFitTypeAndShape) {
  const std::string twelve(12, '\0');
  const auto points = [](const proto::Array& array) {
    return field_of([&] { (void)decode_points(array, "a"); });
  };
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_FLOAT32, {1, 3}, twelve)), "accepted");
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_FLOAT32, {2, 3}, twelve)), "a.data");
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_FLOAT64, {1, 3}, twelve)), "a.data");
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_FLOAT32, {1, 3}, twelve.substr(1))), "a.data");
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_UNSPECIFIED, {1, 3}, twelve)), "a.type");
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_INT32, {1, 3}, twelve)), "a.type");
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_FLOAT32, {3}, twelve)), "a.shape");
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_FLOAT32, {1, 1, 3}, twelve)), "a.shape");
  EXPECT_EQ(points(array_of(proto::DATA_TYPE_FLOAT32, {3, 1}, twelve)), "a.shape[1]");
}

TEST(Arrays, ShapesWhoseProductOverflows) {
  const auto tets = [](const proto::Array& array) {
    return field_of([&] { (void)decode_tets(array, "a"); });
  };
  EXPECT_EQ(tets(array_of(proto::DATA_TYPE_INT32, {1ull << 62, 4}, "")), "a.shape");
  EXPECT_EQ(tets(array_of(proto::DATA_TYPE_INT32, {1ull << 60, 1ull << 60}, "")), "a.shape");
  // 2^62 * 4 * 4 is 0 modulo 2^64: the empty data must not pass.
  EXPECT_EQ(tets(array_of(proto::DATA_TYPE_INT32, {0, 4}, "")), "accepted");
  EXPECT_EQ(tets(array_of(proto::DATA_TYPE_INT32, {0, 1ull << 40}, "")), "a.shape[1]");
  EXPECT_EQ(tets(array_of(proto::DATA_TYPE_INT32, {1ull << 40, 0}, "")), "a.shape[1]");
}

TEST(Arrays, ExtentsBeyondAnIntAreRefusedThoughThereAreNoNumbers) {
  for (const std::uint64_t extent : {1ull << 31, 1ull << 32, 1ull << 63, ~0ull}) {
    EXPECT_EQ(field_of([&] {
                (void)decode_matrix(array_of(proto::DATA_TYPE_FLOAT64, {0, extent}, ""), "a");
              }),
              "a.shape[1]");
    EXPECT_EQ(field_of([&] {
                (void)decode_matrix(array_of(proto::DATA_TYPE_FLOAT64, {extent, 0}, ""), "a");
              }),
              extent > (1ull << 60) ? "a.shape" : "a.shape[0]");  // too many bytes to count
  }
}

TEST(Arrays, NotANumberIsNamedByItsPlace) {
  const auto array = array_of(proto::DATA_TYPE_FLOAT32, {2, 3},
                              bytes_of(std::vector<float>{0, 1, 2, 3, std::nanf(""), 5}));
  try {
    (void)decode_points(array, "mesh.nodes");
    FAIL();
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.field(), "mesh.nodes.data[4]");
    EXPECT_NE(std::string(refusal.what()).find("row 1"), std::string::npos);
  }
}

TEST(Arrays, MotionsAreFramesTimesNodesTimesThree) {
  const auto array =
      array_of(proto::DATA_TYPE_FLOAT32, {2, 1, 3}, bytes_of(std::vector<float>{1, 2, 3, 4, 5, 6}));
  const Eigen::MatrixXd motion = decode_motion(array, "m", 1, 2);
  EXPECT_EQ(motion.col(1), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(field_of([&] { (void)decode_motion(array, "m", 1, 3); }), "m.shape[0]");
  EXPECT_EQ(field_of([&] { (void)decode_motion(array, "m", 2, 2); }), "m.shape[1]");
}

}  // namespace
}  // namespace limber::server
