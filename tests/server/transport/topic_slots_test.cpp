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
  TopicSlots::Send send = [this](const std::string& topic, const StreamBytes& bytes,
                                 TopicSlots::Force force) {
    if (full.count(topic) > 0 && force == TopicSlots::Force::kNo) return TopicSlots::Sent::kFull;
    sent.push_back(topic + ":" + bytes);
    return TopicSlots::Sent::kYes;
  };
};

using Strings = std::vector<std::string>;

TEST(TopicSlots, SendsInOrderWhileNobodyIsFull) {
  TopicSlots slots{milliseconds(20)};
  FakeSocket socket;
  const auto now = Clock::now();
  EXPECT_EQ(slots.put("a", {"1", "2"}, now), 0u);
  slots.flush(socket.send, now);
  slots.put("a", {"3"}, now);
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
    EXPECT_EQ(slots.put("a", {std::to_string(i)}, now), i == 0 ? 0u : 1u);
    slots.flush(socket.send, now);
  }
  EXPECT_TRUE(socket.sent.empty());
  socket.full.clear();
  slots.flush(socket.send, now);
  EXPECT_EQ(socket.sent, Strings{"a:999"});
}

TEST(TopicSlots, AFullTopicHoldsUpNoOther) {
  TopicSlots slots{milliseconds(20)};
  FakeSocket socket;
  socket.full = {"a"};
  slots.put("a", {"1"}, Clock::now());
  slots.put("b", {"1"}, Clock::now());
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
    slots.put("a", {std::to_string(ms)}, begin + milliseconds(ms));
    slots.flush(socket.send, begin + milliseconds(ms));
  }
  EXPECT_EQ(socket.sent, Strings{"a:20"});
}

TEST(Subscriptions, PrefixesMatch) {
  Subscriptions subscriptions;
  EXPECT_FALSE(subscriptions.wanted("jobs"));
  EXPECT_EQ(subscriptions.note(std::string("\1session/a/", 11)), "session/a/");
  EXPECT_TRUE(subscriptions.wanted("session/a/status"));
  EXPECT_FALSE(subscriptions.wanted("session/ab/status"));
  EXPECT_FALSE(subscriptions.wanted("session/a"));
  EXPECT_FALSE(subscriptions.note(std::string("\0session/a/", 11)).has_value());
  EXPECT_FALSE(subscriptions.wanted("session/a/status"));
  EXPECT_EQ(subscriptions.note(std::string("\1", 1)), "");
  EXPECT_TRUE(subscriptions.wanted("anything"));
}

TEST(Subscriptions, HostileOnesCostNothing) {
  Subscriptions subscriptions;
  EXPECT_FALSE(subscriptions.note(std::string(5000, '\1')).has_value());
  EXPECT_FALSE(subscriptions.note("").has_value());
  EXPECT_FALSE(subscriptions.note("\7jobs").has_value());
  for (int i = 0; i < 70000; ++i) (void)subscriptions.note(fmt::format("\1{}", i));
  EXPECT_TRUE(subscriptions.wanted(
      "jobs"));  // beyond what is kept, all is wanted rather than something missed
}

}  // namespace
}  // namespace limber::server
