#include "server/transport/unread_replies.h"

#include <gtest/gtest.h>

#include <vector>

namespace limber::server {
namespace {

constexpr std::uint64_t kMessage = UnreadReplies::kMessageBytes;

struct UnreadRepliesOf : ::testing::Test {
  UnreadReplies::Excess excess;
  std::optional<UnreadReplies> replies;
  std::vector<UnreadReplies::Hold> held;
  bool takes(const std::string& client, std::uint64_t bytes) {
    auto hold = replies->admit(client, bytes - kMessage, excess);
    if (!hold) return false;
    held.push_back(std::move(*hold));
    return true;
  }
};

TEST_F(UnreadRepliesOf, OneClient) {
  replies.emplace(UnreadReplies::Limits{10'000, 1'000'000});
  EXPECT_TRUE(takes("a", 20'000));  // it had none
  EXPECT_FALSE(takes("a", 1000));
  EXPECT_EQ(excess.of, UnreadReplies::Excess::Of::kClient);
  EXPECT_EQ(excess.limit, 10'000u);
  EXPECT_EQ(excess.value, 21'000u);
  EXPECT_TRUE(takes("b", 1000));
  EXPECT_EQ(replies->total(), 21'000u);
  held.clear();
  EXPECT_EQ(replies->total(), 0u);
  EXPECT_TRUE(takes("a", 1000));
}

TEST_F(UnreadRepliesOf, WhatIsKeptLeavesRoomForWhatIsSent) {
  replies.emplace(UnreadReplies::Limits{10'000, 40'000});
  const auto keeps = [this](const std::string& client, std::uint64_t bytes) {
    auto hold = replies->admit_kept(client, bytes - kMessage);
    if (!hold) return false;
    held.push_back(std::move(*hold));
    return true;
  };
  EXPECT_FALSE(keeps("a", 5'001));  // half of its own, though it has none
  EXPECT_TRUE(keeps("a", 5'000));
  EXPECT_FALSE(keeps("a", 1'000));
  EXPECT_TRUE(takes("a", 5'000));
  EXPECT_TRUE(keeps("b", 5'000));
  EXPECT_TRUE(takes("c", 10'000));
  EXPECT_FALSE(keeps("d", 4'000));  // 15,000 are free
  EXPECT_TRUE(keeps("d", 3'000));
  held.clear();
  EXPECT_EQ(replies->total(), 0u);
}

TEST_F(UnreadRepliesOf, AllNeverPassTheTotalAndTheNextOneHasRoom) {
  replies.emplace(UnreadReplies::Limits{1'000'000, 1'000'000});
  std::uint64_t most = 0;
  for (int client = 0; client < 9; ++client) {
    std::uint64_t taken = 0;
    while (takes(std::to_string(client), 1000)) taken += 1000;
    EXPECT_EQ(excess.of, UnreadReplies::Excess::Of::kAll);
    // Half of what the others left: the first half a million, the next a quarter, ...
    EXPECT_GE(taken, client == 0 ? 500'000u : most / 2 - 1000);
    most = taken;
    EXPECT_LT(replies->total(), 1'000'000u);
    if (most < 4000) break;
  }
  EXPECT_FALSE(takes("large", 1'000'000));
}

TEST_F(UnreadRepliesOf, ErrorsHaveBytesOfTheirOwn) {
  replies.emplace(UnreadReplies::Limits{1000, 1000});
  std::vector<UnreadReplies::Hold> errors;
  while (auto hold = replies->admit_error("a", 250)) errors.push_back(std::move(*hold));
  EXPECT_EQ(errors.size(), UnreadReplies::kErrorBytesOfClient / (250 + kMessage));
  EXPECT_TRUE(replies->admit_error("b", 250).has_value());
  EXPECT_TRUE(takes("a", 500));
  errors.clear();
  EXPECT_EQ(replies->total(), 500u);
}

}  // namespace
}  // namespace limber::server
