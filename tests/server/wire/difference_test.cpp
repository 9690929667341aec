#include "server/wire/difference.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::size_t kMost = 1'000'000;

std::string random_bytes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::string bytes(count, ' ');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

/// How long the difference is. It must lead there.
std::size_t size_between(const std::string& before, const std::string& after) {
  const std::string difference = difference_of(before, after);
  EXPECT_EQ(with_difference(before, difference, kMost), after);
  return difference.size();
}

TEST(ServerDifference, WhatStaysTakesNoRoom) {
  const std::string bytes = random_bytes(5000, 1);
  EXPECT_EQ(size_between("", ""), 0U);
  EXPECT_LT(size_between(bytes, bytes), 10U);
  EXPECT_EQ(size_between(bytes, ""), 0U);
  EXPECT_LT(size_between("", bytes), bytes.size() + 10);
  std::string other = bytes;
  other.replace(2000, 8, random_bytes(8, 2));
  EXPECT_LT(size_between(bytes, other), 30U);
  // Taken out of the middle and put to the end, as an edit does with an item of a list.
  other = bytes.substr(0, 1003) + bytes.substr(1050) + bytes.substr(1003, 47) + "new";
  EXPECT_LT(size_between(bytes, other), 60U);
  // Items in another order.
  other = bytes.substr(3000) + bytes.substr(0, 1500) + bytes.substr(1500, 1500);
  EXPECT_LT(size_between(bytes, other), 60U);
}

TEST(ServerDifference, AnyBytesComeBack) {
  std::mt19937 random(7);
  for (unsigned i = 0; i < 2000; ++i) {
    // Of few letters, so that parts are the same by chance.
    const auto text = [&] {
      std::string bytes(random() % 120, ' ');
      for (char& byte : bytes) byte = static_cast<char>('a' + random() % (1 + i % 3));
      return bytes;
    };
    std::string before = text(), after = text();
    if (i % 2 == 0 && !before.empty())
      after = before.substr(random() % before.size()) + after + before;
    size_between(before, after);
  }
}

TEST(ServerDifference, WhatIsNoneIsRefused) {
  const std::string before = random_bytes(100, 3), after = random_bytes(50, 4) + before;
  const std::string difference = difference_of(before, after);
  for (std::size_t size = 1; size < difference.size(); ++size) {
    try {
      EXPECT_NE(with_difference(before, difference.substr(0, size), kMost), after) << size;
    } catch (const Refusal&) {
    }
  }
  EXPECT_THROW((void)with_difference(before.substr(1), difference, kMost), Refusal);
  EXPECT_THROW((void)with_difference(before, difference, after.size() - 1), Refusal);
  EXPECT_THROW((void)with_difference(before, std::string(20, '\xff'), kMost), Refusal);
}

}  // namespace
}  // namespace limber::server
