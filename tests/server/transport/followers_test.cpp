#include "server/transport/followers.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

using Keep = TopicSlots::Keep;
using Clock = Followers::Clock;
using Strings = std::vector<std::string>;
using Taken = FollowAnswer::Taken;

const Clock::time_point kNow{};

struct FollowersOfStreams : ::testing::Test {
  /// @param client  its routing id. @param stream  what it calls its stream
  FollowAnswer follow(const std::string& client, const std::string& stream,
                      const std::vector<std::string>& topics, std::uint64_t read_bytes = 0,
                      const std::string& key = "") {
    return follow_from({client}, stream, topics, read_bytes, key);
  }
  /// @param envelope  the frames before its requests
  FollowAnswer follow_from(const Strings& envelope, const std::string& stream,
                           const std::vector<std::string>& topics, std::uint64_t read_bytes = 0,
                           const std::string& key = "") {
    Following wanted{stream, {}, read_bytes, 0, 7, "name of " + envelope.front()};
    for (const auto& topic : topics) wanted.topics.push_back({topic, 0});
    auto begun = followers.follow(Address{envelope, 0, 0, Role::kView, key}, wanted, ++last, kNow);
    if (begun.follower != nullptr && is_answered) followers.note_answer(begun.follower->number);
    fresh.clear();
    for (const auto& topic : begun.fresh) fresh.push_back(topic.prefix);
    return begun.answer;
  }
  void publish(const std::string& topic, const std::string& text, Keep keep = Keep::kNewest) {
    followers.publish(topic, shared({text}), keep, kNow);
  }
  /// What is sent, "client:text".
  Strings sent() {
    Strings all;
    followers.pump(
        [&](const auto& follower, const auto& message) {
          all.push_back(follower.address.envelope[follower.is_behind_proxy() ? 1 : 0] + ":" +
                        message.bytes->substr(0, 3));
          newest = message.sent_bytes;
          return Followers::Sent::kYes;
        },
        kNow);
    std::sort(all.begin(), all.end());
    return all;
  }
  Subscriptions subscriptions;
  Followers followers{16 << 20, subscriptions};
  std::uint64_t last = 1000, newest = 0;
  bool is_answered = true;  // at once
  Strings fresh;
};

TEST_F(FollowersOfStreams, GetNothingBeforeTheyAreAnswered) {
  is_answered = false;
  follow("A", "a", {"x"});
  publish("x", "one");
  EXPECT_EQ(sent(), Strings{});
  followers.note_answer(last);
  EXPECT_EQ(sent(), Strings{"A:one"});
  follow("A2", "a", {"x"});  // the same stream on another connection
  publish("x", "two");
  EXPECT_EQ(sent(), Strings{});
  followers.note_answer(last);
  EXPECT_EQ(sent(), Strings{"A2:two"});
}

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
  followers.end_connection("A", "the reason");
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
  followers.end_connection("A", "late");
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
  const auto stalled = followers.stalled(std::chrono::seconds(5), later);
  ASSERT_EQ(stalled.size(), 1u);
  EXPECT_EQ(stalled[0]->connection(), "A");
  EXPECT_TRUE(followers.stalled(std::chrono::seconds(6), later).empty());
  EXPECT_EQ(followers.most_stalled(later), stalled[0]);
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
    followers.end_connection(name, "gone");
  }
  EXPECT_FALSE(follow("again", "0", {"x"}).continued);
  EXPECT_TRUE(follow("again 1", "1", {"x"}).continued);
}

TEST_F(FollowersOfStreams, OneThatComesAgainAndAgainTakesThePlaceOfNobody) {
  follow("A", "a", {"x"});
  followers.end_connection("A", "gone");
  for (std::size_t i = 0; i <= 2 * Followers::kMostRemembered; ++i) {
    follow("B", "b", {"x"});
    followers.end_connection("B", "gone");
  }
  EXPECT_TRUE(follow("A2", "a", {"x"}).continued);
}

TEST_F(FollowersOfStreams, ClientsBehindAProxyHaveAStreamEach) {
  follow_from({"proxy", "one"}, "a", {"x"});
  follow_from({"proxy", "two"}, "b", {"x"});
  EXPECT_EQ(followers.size(), 2u);
  publish("x", "new");
  EXPECT_EQ(sent(), (Strings{"one:new", "two:new"}));
  follow_from({"proxy", "two"}, "b", {});
  EXPECT_EQ(followers.size(), 1u);
  EXPECT_EQ(follow_from({"proxy", "one"}, "a", {"x"}).cut_off, "") << "nobody has displaced it";
  followers.end_connection("proxy", "it has ended");
  EXPECT_TRUE(followers.empty());
  EXPECT_EQ(follow_from({"proxy 2", "one"}, "a", {"x"}).cut_off, "it has ended");
}

TEST_F(FollowersOfStreams, FramesThatAreOtherwiseDividedAreAnotherPlace) {
  follow_from({"ab", "c"}, "a", {"x"});
  follow_from({"a", "bc"}, "b", {"x"});
  follow_from({"a", "b", "c"}, "c", {"x"});
  EXPECT_EQ(followers.size(), 3u);
}

TEST_F(FollowersOfStreams, AConnectionHasNotAnyNumberOfStreams) {
  for (std::size_t i = 0; i < Followers::kMostOfConnection; ++i)
    ASSERT_EQ(follow_from({"A", std::to_string(i)}, std::to_string(i), {"x"}).taken, Taken::kYes);
  EXPECT_EQ(follow_from({"A", "more"}, "more", {"x"}).taken, Taken::kTooManyStreams);
  EXPECT_TRUE(follow_from({"A", "0"}, "0", {"x"}).continued);
  EXPECT_EQ(follow_from({"B", "more"}, "more", {"x"}).taken, Taken::kYes);
}

TEST_F(FollowersOfStreams, WhatFindsTheConnectionFullWaits) {
  follow("A", "a", {"x", "y"});
  follow("B", "b", {"x"});
  publish("x", "one");
  publish("y", "two");
  int tried = 0;
  Strings other;
  const auto full = [&](const auto& follower, const auto& message) {
    if (follower.connection() == "A") return ++tried, Followers::Sent::kFull;
    other.push_back(*message.bytes);
    return Followers::Sent::kYes;
  };
  for (int i = 0; i < 3; ++i) followers.pump(full, kNow);
  EXPECT_EQ(tried, 3) << "one message each time";
  EXPECT_EQ(other, Strings{"one"}) << "others are not held up";
  EXPECT_EQ(followers.most_stalled(kNow + std::chrono::seconds(5)), nullptr)
      << "it has not been sent anything that it could read";
  EXPECT_EQ(sent(), (Strings{"A:one", "A:two"})) << "nothing is lost";
  EXPECT_EQ(follow("A", "a", {"x", "y"}, newest).left_out, 0u);
  for (const auto& use : followers.uses(2, kNow)) {
    EXPECT_EQ(use.left_out, 0u);
    EXPECT_EQ(use.sent, use.topics);
  }
}

TEST_F(FollowersOfStreams, TheNewestOfATopicStaysWhereMemoryIsShort) {
  follow("A", "a", {"x", "changes"});
  follow("B", "b", {"x"});
  follow("C", "c", {"z"});
  const std::string large(FollowedStream::kWindow, '.');
  publish("x", "one" + large);
  ASSERT_EQ(sent(), (Strings{"A:one", "B:one"}));  // the window is full
  publish("x", "two" + large);
  publish("changes", "beg" + large, Keep::kBegin);
  publish("changes", "mid" + large, Keep::kOrder);
  publish("changes", "end" + large, Keep::kOrder);
  publish("z", "fou");
  const std::uint64_t limit = 2 * large.size();
  EXPECT_EQ(followers.withhold(limit), 2u) << "what is continued";
  EXPECT_EQ(followers.withhold(limit), 0u) << "B has only the newest, C holds little";
  EXPECT_EQ(sent(), Strings{"C:fou"});
  const auto uses = followers.uses(3, kNow);
  EXPECT_EQ(uses[0].left_out, 2u);
  EXPECT_EQ(uses[1].left_out + uses[2].left_out, 0u);
  const auto later = kNow + std::chrono::seconds(5);
  EXPECT_EQ(followers.stalled(std::chrono::seconds(5), later).size(), 2u) << "they still are";
  Strings rest;
  for (int i = 0; i < 2; ++i) {  // they go on reading
    follow("A", "a", {"x", "changes"}, ~0ull);
    follow("B", "b", {"x"}, ~0ull);
    for (const auto& one : sent()) rest.push_back(one);
  }
  std::sort(rest.begin(), rest.end());
  EXPECT_EQ(rest, (Strings{"A:end", "A:two", "B:two"}));
}

TEST_F(FollowersOfStreams, TheLargestIsTheOneWithMostUnwrittenOfThoseThatHaveStalledFirst) {
  constexpr std::uint64_t kMegabyte = 1 << 20;
  follow("A", "a", {"x"});
  follow("B", "b", {"y"});
  publish("x", "one" + std::string(5 * kMegabyte, '.'));
  publish("y", "two" + std::string(6 * kMegabyte, '.'));
  std::vector<FollowedStream::Message> unwritten;
  followers.pump(
      [&](const auto&, auto& message) {
        unwritten.push_back(std::move(message));
        return Followers::Sent::kYes;
      },
      kNow);
  const auto largest = [&](std::uint64_t limit, Clock::time_point now) {
    const auto* found = followers.largest(limit, now);
    return found == nullptr ? "" : found->connection();
  };
  EXPECT_EQ(largest(2 * kMegabyte, kNow), "B");
  EXPECT_EQ(largest(20 * kMegabyte, kNow), "") << "nobody has more than an equal share";
  publish("x", "thr");
  EXPECT_EQ(largest(2 * kMegabyte, kNow + std::chrono::milliseconds(1)), "A");
  unwritten.clear();
  EXPECT_EQ(largest(2 * kMegabyte, kNow), "");
}

TEST_F(FollowersOfStreams, TooManyPrefixesEndAStream) {
  Strings many(Subscriptions::kMaxOfOne + 1);
  for (std::size_t i = 0; i < many.size(); ++i) many[i] = std::to_string(i);
  EXPECT_EQ(follow("A", "a", many).taken, Taken::kTooManyPrefixes);
  EXPECT_TRUE(followers.empty());
  EXPECT_FALSE(subscriptions.has_subscriber("1"));
}

TEST_F(FollowersOfStreams, AsManyOtherPrefixesTakeThePlaceOfThoseThatThereWere) {
  Strings many(Subscriptions::kMaxOfOne), others(many);
  for (std::size_t i = 0; i < many.size(); ++i) {
    many[i] = "x" + std::to_string(i);
    others[i] = "y" + std::to_string(i);
  }
  ASSERT_EQ(follow("A", "a", many).taken, Taken::kYes);
  EXPECT_EQ(follow("A", "a", others).taken, Taken::kYes);
  EXPECT_FALSE(subscriptions.has_subscriber("x0"));
  EXPECT_TRUE(subscriptions.has_subscriber("y0"));
}

TEST_F(FollowersOfStreams, PrefixesCountByConnection) {
  Strings many(1000);
  std::size_t last_prefix = 0;
  const auto others = [&](std::size_t count) {
    many.resize(count);
    for (auto& prefix : many) prefix = std::to_string(++last_prefix);
    return many;
  };
  ASSERT_EQ(follow("honest", "h", others(1000)).taken, Taken::kYes);
  for (int i = 0; i < 80; ++i)  // more of them, each with fewer
    ASSERT_EQ(follow_from({"A", std::to_string(i)}, std::to_string(i), others(800)).taken,
              Taken::kYes);
  EXPECT_TRUE(subscriptions.take_displaced().empty());
  // Beyond 65,536 one of the same connection makes room, then one for another client.
  for (const Strings& envelope : {Strings{"A", "80"}, Strings{"B"}}) {
    EXPECT_EQ(follow_from(envelope, envelope.back(), others(800)).taken, Taken::kYes);
    const auto displaced = subscriptions.take_displaced();
    ASSERT_EQ(displaced.size(), 1u);
    const auto* follower = followers.of_number(displaced[0]);
    ASSERT_NE(follower, nullptr);
    EXPECT_EQ(follower->connection(), "A");
    followers.end(*follower, "too many");
  }
}

TEST_F(FollowersOfStreams, SharesOfMemoryAreOfConnections) {
  constexpr std::uint64_t kMegabyte = 1 << 20;
  std::vector<FollowedStream::Message> unwritten;
  const auto take = [&](const std::string& topic, std::uint64_t bytes) {
    publish(topic, std::string(bytes, '.'));
    followers.pump(
        [&](const auto&, auto& message) {
          unwritten.push_back(std::move(message));
          return Followers::Sent::kYes;
        },
        kNow);
  };
  follow("honest", "h", {"h"});
  for (int i = 0; i < 9; ++i)
    follow_from({"A", std::to_string(i)}, std::to_string(i), {"a" + std::to_string(i)});
  take("h", 4 * kMegabyte);
  for (int i = 0; i < 9; ++i) take("a" + std::to_string(i), (i == 5 ? 2 : 1) * kMegabyte);
  const auto* largest = followers.largest(9 * kMegabyte, kNow);
  ASSERT_NE(largest, nullptr);
  EXPECT_EQ(largest->address.envelope, (Strings{"A", "5"}));
  follow_from({"honest", "2"}, "h2", {"h2"});  // another stream is no other share
  EXPECT_EQ(followers.largest(9 * kMegabyte, kNow), largest);
  EXPECT_EQ(followers.largest(21 * kMegabyte, kNow), nullptr);
}

}  // namespace
}  // namespace limber::server
