#include "server/transport/followed_stream.h"

#include <gtest/gtest.h>

#include <vector>

#include "server/transport/live_bytes.h"

namespace limber::server {
namespace {

using Keep = TopicSlots::Keep;
using Clock = FollowedStream::Clock;
using std::chrono::seconds;

constexpr std::uint64_t kWindow = FollowedStream::kLeastWindow;
const Clock::time_point kBegin{};

SharedMessages one(std::uint64_t bytes, char letter = 'x') {
  return shared({StreamBytes(bytes, letter)});
}

struct FollowedStreams : ::testing::Test {
  FollowedStreams() { stream.set_window(kWindow); }
  /// Sends what may be sent, and keeps it as if it were written at once.
  std::string send_all() {
    std::string letters;
    while (auto message = stream.next(kBegin)) {
      letters += message->bytes->front();
      newest = message->sent_bytes;
    }
    return letters;
  }
  FollowedStream stream{1 << 20};
  std::uint64_t newest = 0;
};

TEST_F(FollowedStreams, SendsWithinTheWindowAndOneMessagePastIt) {
  for (const char letter : {'a', 'b', 'c', 'd'})
    stream.put(std::string("topic ") + letter, one(kWindow / 2, letter), Keep::kNewest, kBegin);
  EXPECT_EQ(send_all(), "ab");  // with their topics
  EXPECT_GE(stream.unread_bytes(), kWindow);
  EXPECT_EQ(send_all(), "");
  stream.credit(newest, kBegin);
  EXPECT_EQ(stream.unread_bytes(), 0u);
  EXPECT_EQ(send_all(), "cd");
  EXPECT_EQ(stream.waiting_bytes(), 0u);
  EXPECT_EQ(stream.left_out(), 0u);
  EXPECT_EQ(stream.sent(), 4u);
}

TEST_F(FollowedStreams, AMessageLargerThanTheWindowIsSentAlone) {
  stream.put("a", one(20 * kWindow, '1'), Keep::kNewest, kBegin);
  stream.put("b", one(1, '2'), Keep::kNewest, kBegin);
  EXPECT_EQ(send_all(), "1");
  stream.credit(newest - 1, kBegin);  // one byte is missing
  EXPECT_EQ(send_all(), "2");
}

TEST_F(FollowedStreams, WhoDoesNotReadGetsTheNewestAndTheCount) {
  stream.put("a", one(kWindow, '0'), Keep::kNewest, kBegin);
  EXPECT_EQ(send_all(), "0");
  for (char letter = '1'; letter <= '9'; ++letter)
    stream.put("a", one(kWindow, letter), Keep::kNewest, kBegin);
  EXPECT_LE(stream.waiting_bytes(), kWindow + StreamQueue::kMessageBytes);
  stream.credit(newest, kBegin);
  const auto message = stream.next(kBegin);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->bytes->front(), '9');
  EXPECT_EQ(message->left_out, 8u);
}

TEST_F(FollowedStreams, WhatIsInOrderGoesWhereItPassesTheLimit) {
  FollowedStream narrow(3 * kWindow);
  narrow.set_window(kWindow);
  narrow.put("changes", one(kWindow, '0'), Keep::kBegin, kBegin);
  ASSERT_TRUE(narrow.next(kBegin));
  for (char letter = '1'; letter <= '9'; ++letter) {
    narrow.put("changes", one(kWindow, letter), Keep::kOrder, kBegin);
    EXPECT_LE(narrow.waiting_bytes(), 5 * kWindow);
  }
  EXPECT_GT(narrow.left_out(), 0u);
  narrow.put("status", one(1, 's'), Keep::kNewest, kBegin);
  std::string got;
  const std::uint64_t left_out = narrow.left_out();
  for (int i = 0; i < 20; ++i) {
    narrow.credit(~0ull, kBegin);
    if (const auto message = narrow.next(kBegin)) got += message->bytes->front();
  }
  EXPECT_NE(got.find('s'), std::string::npos);
  EXPECT_NE(got.find('9'), std::string::npos);
  EXPECT_EQ(got.size() + left_out, 10u);
}

TEST_F(FollowedStreams, CreditThatLies) {
  std::vector<FollowedStream::Message> unwritten;  // libzmq has them
  for (const char letter : {'0', '1'}) {
    stream.put("a", one(kWindow, letter), Keep::kNewest, kBegin);
    auto message = stream.next(kBegin);
    ASSERT_TRUE(message);
    unwritten.push_back(std::move(*message));
    stream.credit(~0ull, kBegin);
    EXPECT_EQ(stream.unread_bytes(), 0u);
  }
  stream.put("a", one(kWindow, '2'), Keep::kNewest, kBegin);
  EXPECT_FALSE(stream.next(kBegin));  // nothing more before it is on the network
  stream.put("a", one(kWindow, '3'), Keep::kNewest, kBegin);
  EXPECT_LE(stream.waiting_bytes(), kWindow + StreamQueue::kMessageBytes);
  unwritten.clear();
  const auto newest_one = stream.next(kBegin);
  ASSERT_TRUE(newest_one);
  EXPECT_EQ(newest_one->bytes->front(), '3');
}

TEST_F(FollowedStreams, OlderCreditTakesNothingBack) {
  stream.put("a", one(100, '0'), Keep::kNewest, kBegin);
  EXPECT_EQ(send_all(), "0");
  stream.credit(newest, kBegin);
  stream.credit(newest / 2, kBegin);
  EXPECT_EQ(stream.unread_bytes(), 0u);
}

TEST_F(FollowedStreams, ItHasStalledSinceItsLastCreditWhileSomethingWaits) {
  const auto at = [](int s) { return kBegin + seconds(s); };
  const auto stalled = [&](int s) { return stream.stalled_for(at(s)) / seconds(1); };
  stream.put("a", one(kWindow, '0'), Keep::kNewest, at(1));
  ASSERT_EQ(send_all(), "0");
  EXPECT_EQ(stalled(100), 0);  // nothing waits: it has nothing to read, as far as we know
  stream.put("a", one(kWindow, '1'), Keep::kNewest, at(110));
  stream.put("a", one(kWindow, '2'), Keep::kNewest, at(120));
  EXPECT_EQ(stalled(130), 20);
  stream.credit(newest / 2, at(140));  // slow, but it reads
  ASSERT_TRUE(stream.next(at(140)));
  EXPECT_EQ(stalled(150), 0);
}

TEST_F(FollowedStreams, WhatWasUnderWayAtTheEndOfAConnectionIsLeftOut) {
  for (const char letter : {'a', 'b', 'c'})
    stream.put(std::string("topic ") + letter, one(1000, letter), Keep::kNewest, kBegin);
  const auto first = stream.next(kBegin);
  EXPECT_EQ(send_all(), "bc");
  stream.put("a", one(kWindow * 2, '0'), Keep::kNewest, kBegin);
  EXPECT_EQ(send_all(), "0");
  stream.put("a", one(10, '1'), Keep::kNewest, kBegin);  // waits
  stream.suspend();
  EXPECT_EQ(stream.waiting_bytes(), 0u);
  stream.resume(first->sent_bytes, kBegin);
  EXPECT_EQ(stream.left_out(), 4u);  // b, c, 0 and 1
  EXPECT_EQ(stream.unread_bytes(), 0u);
  stream.put("a", one(10, '2'), Keep::kNewest, kBegin);
  const auto next = stream.next(kBegin);
  ASSERT_TRUE(next);
  EXPECT_GT(next->sent_bytes, newest);  // positions go on
}

TEST_F(FollowedStreams, WhatIsPutBackWasNeverSent) {
  stream.put("a", one(100, '0'), Keep::kNewest, kBegin);
  EXPECT_EQ(send_all(), "0");
  const std::uint64_t position = newest;
  stream.put("a", one(20 * kWindow, '1'), Keep::kNewest, kBegin);
  stream.put("b", one(10, '2'), Keep::kNewest, kBegin);
  for (int i = 0; i < 2; ++i) {
    auto message = stream.next(kBegin);
    ASSERT_TRUE(message);
    EXPECT_EQ(message->bytes->front(), '1');
    EXPECT_GT(stream.unwritten_bytes(), 20 * kWindow);
    stream.put_back(std::move(*message), kBegin);
    EXPECT_EQ(stream.sent(), 1u);
    EXPECT_EQ(stream.unread_bytes(), position);
    EXPECT_EQ(stream.unwritten_bytes(), 0u);
    EXPECT_EQ(stream.stalled_for(kBegin + seconds(9)), seconds(0));
  }
  stream.put("a", one(10, '3'), Keep::kNewest, kBegin);  // newer than what came back
  EXPECT_EQ(send_all(), "32");
  EXPECT_EQ(newest, position + 22);
  EXPECT_EQ(stream.left_out(), 1u);
}

TEST_F(FollowedStreams, TheWindowHasBounds) {
  for (const auto& [wanted, taken] :
       {std::pair{std::uint64_t{0}, FollowedStream::kWindow},
        std::pair{std::uint64_t{1}, FollowedStream::kLeastWindow},
        std::pair{std::uint64_t{5'000'000}, std::uint64_t{5'000'000}},
        std::pair{~std::uint64_t{0}, FollowedStream::kLargestWindow}}) {
    stream.set_window(wanted);
    EXPECT_EQ(stream.window(), taken);
  }
}

TEST(LiveBytes, CountsEachMessageOnceUntilTheLastHasLetItGo) {
  std::shared_ptr<const StreamBytes> first;
  {
    LiveBytes live;
    auto messages = live.counted({StreamBytes(1000, 'a'), StreamBytes(2000, 'b')});
    EXPECT_GE(live.total(), 3000u);
    const auto other = messages;
    first = {messages, &messages->front()};
    EXPECT_LT(live.total(), 3500u);
    messages.reset();
    EXPECT_GE(live.total(), 3000u);
  }
  EXPECT_EQ(first->size(), 1000u);  // outlives who counts
  LiveBytes live;
  live.counted({StreamBytes(1000, 'a')}).reset();
  EXPECT_EQ(live.total(), 0u);
}

}  // namespace
}  // namespace limber::server
