#include "server/transport/topic_slots.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "server/transport/subscriptions.h"

namespace limber::server {
namespace {

using std::chrono::milliseconds;
using Clock = TopicSlots::Clock;

/// A socket whose topics can be full.
struct FakeSocket {
  std::set<std::string> full;
  std::vector<std::string> sent;
  TopicSlots::Send send = [this](const std::string& topic,
                                 const std::shared_ptr<const StreamBytes>& bytes,
                                 TopicSlots::Force force) {
    if (full.count(topic) > 0 && force == TopicSlots::Force::kNo) return TopicSlots::Sent::kFull;
    sent.push_back(topic + ":" + *bytes);
    return TopicSlots::Sent::kYes;
  };
};

using Strings = std::vector<std::string>;

TEST(TopicSlots, SendsInOrderWhileNobodyIsFull) {
  TopicSlots slots{milliseconds(20)};
  FakeSocket socket;
  const auto now = Clock::now();
  EXPECT_EQ(slots.put("a", shared({"1", "2"}), now), 0u);
  slots.flush(socket.send, now);
  slots.put("a", shared({"3"}), now);
  slots.flush(socket.send, now);
  EXPECT_EQ(socket.sent, (Strings{"a:1", "a:2", "a:3"}));
  EXPECT_TRUE(slots.empty());
}

TEST(TopicSlots, TheNewestReplacesWhatWaits) {
  TopicSlots slots{milliseconds(20)};
  FakeSocket socket;
  socket.full = {"a"};
  const auto now = Clock::now();
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(slots.put("a", shared({std::to_string(i)}), now), i == 0 ? 0u : 1u);
    slots.flush(socket.send, now);
  }
  EXPECT_TRUE(socket.sent.empty());
  socket.full.clear();
  slots.flush(socket.send, now);
  EXPECT_EQ(socket.sent, Strings{"a:999"});
}

TEST(TopicSlots, MessagesThatContinueEachOtherWaitInOrder) {
  TopicSlots slots{milliseconds(20)};
  FakeSocket socket;
  socket.full = {"a"};
  const auto now = Clock::now();
  EXPECT_EQ(slots.put("a", shared({"1", "2"}), now, TopicSlots::Keep::kOrder), 0u);
  EXPECT_EQ(slots.put("a", shared({"3"}), now, TopicSlots::Keep::kOrder), 0u);
  slots.flush(socket.send, now);
  socket.full.clear();
  slots.flush(socket.send, now);
  EXPECT_EQ(socket.sent, (Strings{"a:1", "a:2", "a:3"}));
}

TEST(TopicSlots, ButNotEverMoreOfThem) {
  TopicSlots slots{milliseconds(20)};
  FakeSocket socket;
  socket.full = {"a"};
  const auto now = Clock::now();
  std::size_t given_up = 0;
  for (std::size_t i = 0; i < 100; ++i)
    given_up += slots.put("a", shared({std::to_string(i)}), now, TopicSlots::Keep::kOrder);
  EXPECT_EQ(given_up, 100 - TopicSlots::kMostInOrder);
  socket.full.clear();
  slots.flush(socket.send, now);
  ASSERT_EQ(socket.sent.size(), TopicSlots::kMostInOrder);
  EXPECT_EQ(socket.sent.back(), "a:99") << "the oldest go";
}

TEST(TopicSlots, AFullTopicHoldsUpNoOther) {
  TopicSlots slots{milliseconds(20)};
  FakeSocket socket;
  socket.full = {"a"};
  slots.put("a", shared({"1"}), Clock::now());
  slots.put("b", shared({"1"}), Clock::now());
  slots.flush(socket.send, Clock::now());
  EXPECT_EQ(socket.sent, Strings{"b:1"});
}

TEST(TopicSlots, PatienceEndsEvenWhileNewerOnesArrive) {
  TopicSlots slots{milliseconds(20)};
  FakeSocket socket;
  socket.full = {"a"};
  const auto begin = Clock::now();
  int ms = 0;
  for (; ms < 40 && socket.sent.empty(); ++ms) {
    slots.put("a", shared({std::to_string(ms)}), begin + milliseconds(ms));
    slots.flush(socket.send, begin + milliseconds(ms));
  }
  EXPECT_EQ(socket.sent, Strings{"a:20"});
}

TEST(Subscriptions, PrefixesMatch) {
  Subscriptions subscriptions;
  EXPECT_FALSE(subscriptions.has_subscriber("jobs"));
  using Noted = Subscriptions::Noted;
  EXPECT_EQ(subscriptions.note(1, std::string("\1session/a/", 11)), Noted::kSubscription);
  EXPECT_EQ(subscriptions.note(2, std::string("\1session/a/", 11)), Noted::kSubscription);
  EXPECT_TRUE(subscriptions.has_subscriber("session/a/status"));
  EXPECT_FALSE(subscriptions.has_subscriber("session/ab/status"));
  EXPECT_FALSE(subscriptions.has_subscriber("session/a"));
  EXPECT_EQ(subscriptions.note(1, std::string("\0session/a/", 11)), Noted::kNothing);
  EXPECT_TRUE(subscriptions.has_subscriber("session/a/status"));  // by the other connection
  EXPECT_EQ(subscriptions.note(0, std::string("\0session/a/", 11)), Noted::kNothing);
  EXPECT_TRUE(subscriptions.has_subscriber("session/a/status"));
  subscriptions.forget(2);
  EXPECT_FALSE(subscriptions.has_subscriber("session/a/status"));
  EXPECT_EQ(subscriptions.note(3, std::string("\1", 1)), Noted::kSubscription);
  EXPECT_TRUE(subscriptions.has_subscriber("anything"));
}

TEST(Subscriptions, HostileOnesCostNothing) {
  using Noted = Subscriptions::Noted;
  Subscriptions subscriptions;
  EXPECT_EQ(subscriptions.note(1, std::string(500, '\1')), Noted::kNothing);
  EXPECT_EQ(subscriptions.note(1, ""), Noted::kNothing);
  EXPECT_EQ(subscriptions.note(1, "\7jobs"), Noted::kNothing);
  int cut_off = 0;
  for (int i = 0; i < 70000; ++i)
    cut_off += subscriptions.note(2, fmt::format("\1p{:05}", i)) == Noted::kTooMany ? 1 : 0;
  EXPECT_EQ(cut_off, 1);
  EXPECT_TRUE(subscriptions.has_subscriber("p01023"));
  EXPECT_FALSE(subscriptions.has_subscriber("p01024"));
  EXPECT_EQ(subscriptions.note(3, "\1jobs"), Noted::kSubscription);  // others are not concerned
  subscriptions.forget(2);
  EXPECT_FALSE(subscriptions.has_subscriber("p01023"));
  EXPECT_TRUE(subscriptions.has_subscriber("jobs"));
}

TEST(Subscriptions, OfAllTogetherAreBounded) {
  using Noted = Subscriptions::Noted;
  Subscriptions subscriptions;
  for (int i = 0; i < 65536; ++i) {
    const auto connection = static_cast<std::uint64_t>(1 + i / 1000);
    ASSERT_EQ(subscriptions.note(connection, fmt::format("\1{}", i)), Noted::kSubscription);
  }
  EXPECT_EQ(subscriptions.note(101, "\0017"), Noted::kSubscription);  // which somebody has
  EXPECT_TRUE(subscriptions.take_displaced().empty());
  // A newcomer takes the place of one that has most, not of one that has few.
  EXPECT_EQ(subscriptions.note(100, "\1jobs"), Noted::kSubscription);
  EXPECT_EQ(subscriptions.take_displaced(), std::vector<std::uint64_t>{1});
  EXPECT_TRUE(subscriptions.take_displaced().empty());
  EXPECT_TRUE(subscriptions.has_subscriber("jobs"));
  EXPECT_TRUE(subscriptions.has_subscriber("7"));  // the other one that has it
  EXPECT_TRUE(subscriptions.has_subscriber("65535"));
  EXPECT_EQ(subscriptions.note(1, "\1again"), Noted::kNothing);
  subscriptions.forget(1);
}

TEST(Subscriptions, GroupsMakeRoomTogether) {
  using Noted = Subscriptions::Noted;
  Subscriptions subscriptions;
  for (int i = 0; i < 65536; ++i) {  // 66 of 1000, but for one: of 500 each, two of them a group
    const int one = 1 + i / 1000;
    const bool is_grouped = one == 7;
    const auto number = static_cast<std::uint64_t>(is_grouped && i % 2 == 0 ? 1007 : one);
    ASSERT_EQ(subscriptions.note(number, fmt::format("\1{}", i), is_grouped ? 1007 : 0),
              Noted::kSubscription);
  }
  ASSERT_EQ(subscriptions.note(1007, "\0010", 1007), Noted::kSubscription);  // known: one more
  EXPECT_EQ(subscriptions.note(100, "\1new"), Noted::kSubscription);
  EXPECT_EQ(subscriptions.take_displaced(), std::vector<std::uint64_t>{1007});
  EXPECT_TRUE(subscriptions.has_subscriber("6001"));  // the other one of the group
}

TEST(Subscriptions, WhoHasMostMakesRoomForNobodyElse) {
  using Noted = Subscriptions::Noted;
  Subscriptions subscriptions;
  for (int i = 0; i < 65536; ++i) {
    const auto connection = static_cast<std::uint64_t>(1 + i / 1000);
    ASSERT_EQ(subscriptions.note(connection, fmt::format("\1{}", i)), Noted::kSubscription);
  }
  EXPECT_EQ(subscriptions.note(5, "\1one more"), Noted::kTooMany);
  EXPECT_TRUE(subscriptions.take_displaced().empty());
  subscriptions.forget(1);
  EXPECT_EQ(subscriptions.note(102, "\1jobs"), Noted::kSubscription);
  EXPECT_TRUE(subscriptions.take_displaced().empty());
}

}  // namespace
}  // namespace limber::server
