#include "engine/scene/formats/point_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "engine/base/error.h"

namespace limber::scene {
namespace {

PointCache small_cache() {
  PointCache cache;
  cache.start_frame = 3;
  cache.frames_per_sample = 0.5;
  cache.positions.resize(6, 2);
  cache.positions << 1, 7, 2, 8, 3, 9, 4, 10, 5, 11, 6, 12;
  return cache;
}

TEST(PointCaches, HaveTheLayoutBlenderReads) {
  const std::string bytes = write_pc2(small_cache());
  ASSERT_EQ(bytes.size(), 32 + 4 * 12);
  EXPECT_EQ(bytes.substr(0, 12), std::string("POINTCACHE2\0", 12));
  const auto int_at = [&](std::size_t at) {
    std::int32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  const auto float_at = [&](std::size_t at) {
    float value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  EXPECT_EQ(int_at(12), 1);
  EXPECT_EQ(int_at(16), 2);
  EXPECT_EQ(float_at(20), 3.0f);
  EXPECT_EQ(float_at(24), 0.5f);
  EXPECT_EQ(int_at(28), 2);
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(float_at(32 + 4 * i), static_cast<float>(i + 1));
}

TEST(PointCaches, ComeBackAsTheyWere) {
  const PointCache cache = small_cache(), back = read_pc2("a", write_pc2(cache));
  EXPECT_EQ(back.positions, cache.positions);
  EXPECT_EQ(back.start_frame, cache.start_frame);
  EXPECT_EQ(back.frames_per_sample, cache.frames_per_sample);
  EXPECT_EQ(read_pc2("a", write_pc2(PointCache{})).sample_count(), 0);
}

TEST(PointCaches, ThatAreBrokenAreRefused) {
  const std::string good = write_pc2(small_cache());
  const auto refused = [](std::string bytes, ErrorCode code) {
    try {
      static_cast<void>(read_pc2("a.pc2", bytes));
    } catch (const Error& error) {
      EXPECT_EQ(error.field(), "a.pc2");
      return error.code() == code;
    }
    return false;
  };
  EXPECT_TRUE(refused("POINTCACHE1", ErrorCode::kInvalidArgument));
  EXPECT_TRUE(refused(good.substr(0, 20), ErrorCode::kInvalidArgument));
  EXPECT_TRUE(refused(good.substr(0, good.size() - 1), ErrorCode::kInvalidArgument));
  EXPECT_TRUE(refused(good + "x", ErrorCode::kInvalidArgument));
  std::string version = good;
  version[12] = 2;
  EXPECT_TRUE(refused(version, ErrorCode::kUnsupported));
  std::string huge = good;
  std::memset(huge.data() + 16, 0x7f, 4);
  std::memset(huge.data() + 28, 0x7f, 4);
  EXPECT_TRUE(refused(huge, ErrorCode::kInvalidArgument));
  std::string pointless = good.substr(0, 32);  // two thousand million samples in 32 bytes
  std::memset(pointless.data() + 16, 0, 4);
  std::memset(pointless.data() + 28, 0x7f, 4);
  EXPECT_TRUE(refused(pointless, ErrorCode::kInvalidArgument));
  std::string negative = good;
  std::memset(negative.data() + 28, 0xff, 4);
  EXPECT_TRUE(refused(negative, ErrorCode::kInvalidArgument));
  std::string nan = good;
  std::memset(nan.data() + 40, 0xff, 4);
  EXPECT_TRUE(refused(nan, ErrorCode::kInvalidArgument));
  PointCache odd;
  odd.positions = Eigen::MatrixXf::Zero(4, 1);
  EXPECT_THROW(static_cast<void>(write_pc2(odd)), Error);
}

}  // namespace
}  // namespace limber::scene
