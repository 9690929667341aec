#include "server/transport/followers.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

using Keep = TopicSlots::Keep;
using Clock = Followers::Clock;
using Strings = std::vector<std::string>;

const Clock::time_point kNow{};

struct FollowersOfStreams : ::testing::Test {
  /// @param client  its routing id. @param stream  what it calls its stream
  FollowAnswer follow(const std::string& client, const std::string& stream,
                      const std::vector<std::string>& topics, std::uint64_t read_bytes = 0,
                      const std::string& key = "") {
    Following wanted{stream, {}, read_bytes, 0, 7, "name of " + client};
    for (const auto& topic : topics) wanted.topics.push_back({topic, 0});
    auto begun = followers.follow(Address{{client}, 0, 0, Role::kView, key}, wanted, ++last, kNow);
    fresh.clear();
    for (const auto& topic : begun.fresh) fresh.push_back(topic.prefix);
    return begun.answer;
  }
  void publish(const std::string& topic, const std::string& text) {
    followers.publish(topic, shared({text}), Keep::kNewest, kNow);
  }
  /// What is sent, "client:text".
  Strings sent() {
    Strings all;
    followers.pump(
        [&](const auto& follower, const auto& message) {
          all.push_back(follower.address.envelope.front() + ":" + message.bytes->substr(0, 3));
          newest = message.sent_bytes;
        },
        kNow);
    std::sort(all.begin(), all.end());
    return all;
  }
  Subscriptions subscriptions;
  Followers followers{1 << 20, subscriptions};
  std::uint64_t last = 1000, newest = 0;
  Strings fresh;
};

TEST_F(FollowersOfStreams, GetWhatTheyWant) {
  EXPECT_FALSE(follow("A", "a", {"x", "y"}).continued);
  EXPECT_EQ(fresh, (Strings{"x", "y"}));
  follow("B", "b", {"y"});
  EXPECT_TRUE(subscriptions.has_subscriber("x/1"));
  publish("x/1", "one");
  publish("y", "two");
  publish("z", "not");
  EXPECT_EQ(sent(), (Strings{"A:one", "A:two", "B:two"}));
  EXPECT_TRUE(follow("A", "a", {"y", "z"}).continued);
  EXPECT_EQ(fresh, Strings{"z"});
  EXPECT_FALSE(subscriptions.has_subscriber("x/1"));
  publish("x/1", "not");
  publish("z", "zzz");
  EXPECT_EQ(sent(), Strings{"A:zzz"});
  EXPECT_FALSE(follow("A", "a", {}).cut_off.size());
  EXPECT_FALSE(subscriptions.has_subscriber("z"));
  EXPECT_EQ(followers.size(), 1u);
}

TEST_F(FollowersOfStreams, AStreamGoesOnOnAnotherConnection) {
  follow("A", "a", {"x"});
  publish("x", "one");
  ASSERT_EQ(sent(), Strings{"A:one"});
  followers.end("A", "the reason");
  EXPECT_TRUE(followers.empty());
  EXPECT_FALSE(subscriptions.has_subscriber("x"));
  publish("x", "two");
  const auto answer = follow("A2", "a", {"x"}, newest);
  EXPECT_TRUE(answer.continued);
  EXPECT_EQ(answer.cut_off, "the reason");
  EXPECT_EQ(answer.left_out, 0u);
  EXPECT_EQ(fresh, Strings{"x"});  // a snapshot is due
  EXPECT_EQ(follow("A2", "a", {"x"}, newest).cut_off, "") << "told once";
}

TEST_F(FollowersOfStreams, TheNewestConnectionOfAStreamCounts) {
  follow("A", "a", {"x"});
  const auto answer = follow("B", "a", {"x"});  // the end of A is not noticed yet
  EXPECT_TRUE(answer.continued);
  EXPECT_NE(answer.cut_off, "");
  publish("x", "one");
  EXPECT_EQ(sent(), Strings{"B:one"});
  followers.end("A", "late");
  EXPECT_EQ(followers.size(), 1u);
  follow("B", "another", {"x"});  // one stream a connection
  EXPECT_EQ(followers.size(), 1u);
}

TEST_F(FollowersOfStreams, NobodyTakesTheStreamOfAnotherKey) {
  follow("A", "a", {"x"}, 0, "key of A");
  EXPECT_FALSE(follow("B", "a", {"x"}, 0, "key of B").continued);
  EXPECT_EQ(followers.size(), 2u);
}

TEST_F(FollowersOfStreams, OneThatDoesNotReadHoldsUpNobody) {
  follow("A", "a", {"x"});
  follow("B", "b", {"x"});
  const std::string large(FollowedStream::kWindow, '.');
  publish("x", "one" + large);
  ASSERT_EQ(sent(), (Strings{"A:one", "B:one"}));
  follow("B", "b", {"x"}, newest);
  publish("x", "two" + large);
  EXPECT_EQ(sent(), Strings{"B:two"});
  follow("B", "b", {"x"}, newest);
  publish("x", "thr" + large);
  EXPECT_EQ(sent(), Strings{"B:thr"});
  const auto later = kNow + std::chrono::seconds(5);
  EXPECT_EQ(followers.stalled(std::chrono::seconds(5), later), Strings{"A"});
  EXPECT_EQ(followers.stalled(std::chrono::seconds(6), later), Strings{});
  EXPECT_EQ(followers.most_stalled(later), "A");
  const auto uses = followers.uses(1, later);
  ASSERT_EQ(uses.size(), 1u);
  EXPECT_EQ(uses[0].name, "name of A");
  EXPECT_EQ(uses[0].left_out, 1u);
  EXPECT_GT(uses[0].waiting_bytes, large.size());
  EXPECT_DOUBLE_EQ(uses[0].stalled_s, 5);
}

TEST_F(FollowersOfStreams, OfThoseThatWentTheNewestAreRemembered) {
  for (std::size_t i = 0; i <= Followers::kMostRemembered; ++i) {
    const std::string name = std::to_string(i);
    follow(name, name, {"x"});
    followers.end(name, "gone");
  }
  EXPECT_FALSE(follow("again", "0", {"x"}).continued);
  EXPECT_TRUE(follow("again 1", "1", {"x"}).continued);
}

TEST_F(FollowersOfStreams, OneThatComesAndGoesTakesTheMemoryOfNoOther) {
  follow("B", "b", {"x"});
  followers.end("B", "b is gone");
  for (std::size_t i = 0; i <= Followers::kMostRemembered; ++i) {
    follow("A", "a", {"x"});
    followers.end("A", "a is gone");
  }
  EXPECT_EQ(follow("B", "b", {"x"}).cut_off, "b is gone");
  EXPECT_EQ(follow("A", "a", {"x"}).cut_off, "a is gone");
}

TEST_F(FollowersOfStreams, TooManyPrefixesEndAStream) {
  Strings many(Subscriptions::kMaxOfOne + 1);
  for (std::size_t i = 0; i < many.size(); ++i) many[i] = std::to_string(i);
  EXPECT_FALSE(follow("A", "a", many).is_taken);
  EXPECT_TRUE(followers.empty());
  EXPECT_FALSE(subscriptions.has_subscriber("1"));
}

}  // namespace
}  // namespace limber::server
