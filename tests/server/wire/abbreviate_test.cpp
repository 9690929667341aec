#include "server/wire/abbreviate.h"

#include <gtest/gtest.h>

#include <string>

namespace limber::server {
namespace {

TEST(ServerAbbreviate, KeepsWhatIsShortEnough) {
  EXPECT_EQ(abbreviate(""), "");
  EXPECT_EQ(abbreviate(std::string(100, 'x')), std::string(100, 'x'));
  EXPECT_EQ(abbreviate(std::string(101, 'x')), std::string(100, 'x') + ".. (101 bytes)");
  EXPECT_EQ(abbreviate("abcdef", 3), "abc.. (6 bytes)");
}

/// A cut character would make the reply no UTF-8, which no client could read.
TEST(ServerAbbreviate, CutsBetweenCharacters) {
  const std::string text = "a\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80";  // 1, 2, 3 and 4 bytes
  EXPECT_EQ(abbreviate(text, 2), "a.. (10 bytes)");
  EXPECT_EQ(abbreviate(text, 3), "a\xC3\xA4.. (10 bytes)");
  EXPECT_EQ(abbreviate(text, 5), "a\xC3\xA4.. (10 bytes)");
  EXPECT_EQ(abbreviate(text, 6), "a\xC3\xA4\xE2\x82\xAC.. (10 bytes)");
  EXPECT_EQ(abbreviate(text, 9), "a\xC3\xA4\xE2\x82\xAC.. (10 bytes)");
  EXPECT_EQ(abbreviate(text, 10), text);
  EXPECT_EQ(abbreviate("\x80\x80\x80", 2), ".. (3 bytes)");  // no character at all
}

}  // namespace
}  // namespace limber::server
