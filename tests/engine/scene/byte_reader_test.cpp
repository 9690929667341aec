#include "engine/scene/formats/byte_reader.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace limber::scene::formats {
namespace {

TEST(ByteReader, ReadsBothOrders) {
  const char* const bytes = "\x01\x02\x03\x04\x05\x06\x07\x08";
  EXPECT_EQ(decode<std::uint32_t>(bytes, ByteOrder::kLittle), 0x04030201u);
  EXPECT_EQ(decode<std::uint32_t>(bytes, ByteOrder::kBig), 0x01020304u);
  EXPECT_EQ(decode<std::uint64_t>(bytes, ByteOrder::kBig), 0x0102030405060708u);
  EXPECT_EQ(decode<std::uint8_t>(bytes + 2, ByteOrder::kBig), 3);
  EXPECT_EQ(decode<std::uint16_t>(bytes + 1, ByteOrder::kLittle), 0x0302);  // not aligned
}

TEST(ByteReader, ReadsSignsAndFloatingPoint) {
  EXPECT_EQ(decode<std::int16_t>("\xFF\xFE", ByteOrder::kBig), -2);
  EXPECT_EQ(decode<std::int32_t>("\xFE\xFF\xFF\xFF", ByteOrder::kLittle), -2);
  EXPECT_EQ(decode<float>("\x3F\xC0\x00\x00", ByteOrder::kBig), 1.5f);
  EXPECT_EQ(decode<double>("\x00\x00\x00\x00\x00\x00\x04\xC0", ByteOrder::kLittle), -2.5);
}

}  // namespace
}  // namespace limber::scene::formats
