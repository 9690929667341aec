#include "server/web/shares.h"

#include <gtest/gtest.h>

namespace limber::server::web {
namespace {

constexpr std::uint64_t kMessage = 100;

int places(Shares& shares, Role role) {
  int taken = 0;
  while (shares.take_place(role)) ++taken;
  return taken;
}

TEST(Shares, LesserRolesLeavePlacesToGreaterOnes) {
  Shares shares(64, kMessage);
  EXPECT_EQ(places(shares, Role::kView), 48);
  EXPECT_EQ(places(shares, Role::kEdit), 8);
  EXPECT_EQ(places(shares, Role::kAdminister), 8);
  shares.leave_place(Role::kAdminister);
  EXPECT_FALSE(shares.take_place(Role::kView));
  EXPECT_FALSE(shares.take_place(Role::kEdit));
  EXPECT_TRUE(shares.take_place(Role::kAdminister));
}

TEST(Shares, GreaterRolesMayTakeAllPlaces) {
  Shares shares(64, kMessage);
  EXPECT_EQ(places(shares, Role::kAdminister), 64);
  EXPECT_EQ(places(shares, Role::kView), 0);
  shares.leave_place(Role::kAdminister);
  EXPECT_TRUE(shares.take_place(Role::kView)) << "it is the first of those who look";
  EXPECT_FALSE(shares.take_place(Role::kAdminister));
}

TEST(Shares, OfFewPlacesNoneIsLeft) {
  Shares shares(3, kMessage);
  EXPECT_EQ(places(shares, Role::kView), 3);
}

TEST(Shares, OfEightPlacesAPageOfEachRoleHasRoom) {
  Shares shares(8, kMessage);
  EXPECT_EQ(places(shares, Role::kView), 4);
  EXPECT_EQ(places(shares, Role::kEdit), 2);
  EXPECT_EQ(places(shares, Role::kAdminister), 2);
}

TEST(Shares, UnfinishedMessagesAreBoundedInSum) {
  Shares shares(64, kMessage);
  EXPECT_FALSE(shares.take_bytes(Role::kView, 1)) << "its messages are small";
  EXPECT_TRUE(shares.take_bytes(Role::kEdit, 60));
  EXPECT_FALSE(shares.take_bytes(Role::kEdit, 41));
  EXPECT_TRUE(shares.take_bytes(Role::kEdit, 40));
  EXPECT_TRUE(shares.take_bytes(Role::kAdminister, 100)) << "one of the largest beside those";
  EXPECT_FALSE(shares.take_bytes(Role::kAdminister, 1));
  shares.give_bytes_back(Role::kEdit, 60);
  EXPECT_TRUE(shares.take_bytes(Role::kAdminister, 60));
  EXPECT_FALSE(shares.take_bytes(Role::kEdit, 1));
}

TEST(Shares, MessagesOfWhoMayOnlyLookAreSmall) {
  const Shares shares(64, kMessage);
  EXPECT_EQ(shares.largest_message(Role::kView), Shares::kFreeBytes);
  EXPECT_GT(shares.largest_message(Role::kEdit), 2 * kMessage);
}

}  // namespace
}  // namespace limber::server::web
