#include "server/web/token.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "engine/base/error.h"
#include "tests/support/temporary_folder.h"

namespace limber::server::web {
namespace {

namespace fs = std::filesystem;

TEST(Token, IsRandomAndLong) {
  const std::string token = make_token();
  EXPECT_EQ(token.size(), 32u);
  EXPECT_EQ(token.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(token, make_token());
}

TEST(Token, IsComparedAsAWhole) {
  EXPECT_TRUE(is_same_token("abcd", "abcd"));
  for (const std::string_view other : {"", "a", "abc", "abce", "bbcd", "abcda", "abcdabcd", "ABCD"})
    EXPECT_FALSE(is_same_token(other, "abcd")) << other;
}

TEST(Token, EachRoleHasOneThatStays) {
  const std::string token = make_token();
  const Tokens tokens(token), again(token), others(make_token());
  EXPECT_EQ(tokens.of(Role::kAdminister), token);
  for (const Role role : {Role::kView, Role::kEdit, Role::kAdminister}) {
    EXPECT_EQ(tokens.role_of(tokens.of(role)), role);
    EXPECT_EQ(tokens.of(role), again.of(role));
    EXPECT_FALSE(others.role_of(tokens.of(role)));
    EXPECT_GE(tokens.of(role).size(), 32u);
  }
  EXPECT_FALSE(tokens.role_of(""));
  EXPECT_FALSE(tokens.role_of(token + "0"));
}

class TokenFile : public ::testing::Test {
 protected:
  std::string read(const std::string& text, fs::perms mode = fs::perms::owner_read) const {
    const fs::path file = folder_.path() / "token";
    fs::remove(file);
    std::ofstream(file) << text;
    fs::permissions(file, mode);
    return read_token(file);
  }
  ErrorCode refusal(const std::string& text, fs::perms mode = fs::perms::owner_read) const {
    try {
      ADD_FAILURE() << "taken: " << read(text, mode);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::kInternal;
  }
  TemporaryFolder folder_;
};

TEST_F(TokenFile, HoldsTheTokenInItsFirstLine) {
  EXPECT_EQ(read("0123456789abcdef"), "0123456789abcdef");
  EXPECT_EQ(read("ABC-xyz_0123456789\r\nmore\n"), "ABC-xyz_0123456789");
}

TEST_F(TokenFile, IsItsOwnersAlone) {
  EXPECT_EQ(refusal("0123456789abcdef\n", fs::perms::owner_read | fs::perms::group_read),
            ErrorCode::kInvalidArgument);
  EXPECT_EQ(refusal("0123456789abcdef\n", fs::perms::owner_read | fs::perms::others_read),
            ErrorCode::kInvalidArgument);
}

TEST_F(TokenFile, HoldsNothingElse) {
  EXPECT_EQ(refusal(""), ErrorCode::kIo);
  EXPECT_EQ(refusal("0123456789abcde\n"), ErrorCode::kInvalidArgument);
  EXPECT_EQ(refusal("0123456789 abcdef\n"), ErrorCode::kInvalidArgument);
  EXPECT_EQ(refusal("0123456789abcdef%\n"), ErrorCode::kInvalidArgument);
  EXPECT_EQ(refusal(std::string(129, 'a')), ErrorCode::kInvalidArgument);
  EXPECT_THROW((void)read_token(folder_.path()), Error);
  EXPECT_THROW((void)read_token(folder_.path() / "missing"), Error);
}

}  // namespace
}  // namespace limber::server::web
