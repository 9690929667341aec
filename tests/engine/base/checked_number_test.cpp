#include "engine/base/checked_number.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>

namespace limber {
namespace {

TEST(CheckedNumber, IntegersThatAreHeldStayAsTheyAre) {
  EXPECT_EQ(to_whole<int>(std::uint64_t{7}), 7);
  EXPECT_EQ(to_whole<int>(std::int64_t{-2147483648}), std::numeric_limits<int>::min());
  EXPECT_EQ(to_whole<std::uint64_t>(std::numeric_limits<std::uint64_t>::max()),
            std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(to_whole<std::size_t>(0), 0U);
}

TEST(CheckedNumber, IntegersThatAreNotHeldAreNoNumber) {
  EXPECT_FALSE(to_whole<int>(std::uint64_t{1} << 32));  // a cast would make it 0
  EXPECT_FALSE(to_whole<int>(std::uint32_t{1} << 31));
  EXPECT_FALSE(to_whole<int>(std::int64_t{-2147483649}));
  EXPECT_FALSE(to_whole<std::size_t>(-1));
  EXPECT_FALSE(to_whole<std::int64_t>(std::uint64_t{1} << 63));
  EXPECT_FALSE(to_whole<std::uint16_t>(65536));
}

TEST(CheckedNumber, OfFloatingPointNumbersOnlyWholeOnesWithinTheType) {
  EXPECT_EQ(to_whole<int>(5.0), 5);
  EXPECT_EQ(to_whole<int>(-2147483648.0), std::numeric_limits<int>::min());
  EXPECT_EQ(to_whole<std::int64_t>(-9223372036854775808.0),
            std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(to_whole<unsigned>(4294967295.0), 4294967295U);
  EXPECT_EQ(to_whole<int>(16777216.0f), 16777216);
  for (const double value :
       {0.5, -0.5, 1e300, -1e300, 2147483648.0, -2147483649.0,
        std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
        std::numeric_limits<double>::quiet_NaN()})
    EXPECT_FALSE(to_whole<int>(value)) << value;
  EXPECT_FALSE(to_whole<std::int64_t>(9223372036854775808.0));
  EXPECT_FALSE(to_whole<std::uint64_t>(18446744073709551616.0));
  EXPECT_FALSE(to_whole<unsigned>(-1.0));
}

TEST(CheckedNumber, TextsAreNumbersFromTheirFirstToTheirLastCharacter) {
  EXPECT_EQ(parse_number<int>("-12"), -12);
  EXPECT_EQ(parse_number<std::uint64_t>("18446744073709551615"),
            std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(parse_number<double>("2.5e3"), 2500);
  for (const char* text : {"", " 1", "1 ", "+1", "1x", "x", "0x10", "1.5", "4294967296", "-"})
    EXPECT_FALSE(parse_number<int>(text)) << text;
  EXPECT_FALSE(parse_number<std::uint16_t>("65536"));
  EXPECT_FALSE(parse_number<unsigned>("-1"));
}

}  // namespace
}  // namespace limber
