#include "server/transport/local_peers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>

#include "server/transport/transport.h"

namespace limber::server {
namespace {

using Strings = std::vector<std::string>;

/// Writes down what it is told.
class Diary {
 public:
  void add(const std::string& line) {
    {
      const std::lock_guard lock(mutex_);
      lines_.push_back(line);
    }
    changed_.notify_all();
  }
  /// Once there are so many; sorted, since threads take turns as they like.
  Strings sorted(std::size_t count) {
    Strings lines = this->lines(count);
    std::sort(lines.begin(), lines.end());
    return lines;
  }
  Strings lines(std::size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(30), [&] { return lines_.size() >= count; });
    return lines_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Strings lines_;
};

class WritingPeer : public LocalPeer {
 public:
  explicit WritingPeer(Diary& diary) : diary_(diary) {}
  void taken(std::size_t bytes) override { diary_.add("taken " + std::to_string(bytes)); }
  void reply(std::string bytes, UnreadReplies::Hold unread) override {
    { const UnreadReplies::Hold written = std::move(unread); }
    diary_.add("reply " + bytes);
  }
  void publish(const std::string& topic, const SharedMessages& messages,
               TopicSlots::Keep) override {
    for (const auto& bytes : *messages) diary_.add(topic + " " + bytes.substr(0, bytes.size() - 2));
  }
  void cut_off(const std::string& reason) override { diary_.add("cut off: " + reason); }

 private:
  Diary& diary_;
};

struct LocalPeersOfATransport : ::testing::Test {
  LocalPeersOfATransport() {
    transport.start(
        {[this](Address address, zmq::message_t payload) {
           clients.push_back(address.envelope.front());
           if (payload.to_string_view() == "silence") return;
           transport.send(std::move(address), "to " + payload.to_string());
         },
         [this](const std::string& prefix, Has) { transport.publish(prefix + "x", {"hi"}); },
         [](const Address&, const UnreadReplies::Excess&) { return std::string(); },
         [](const std::string&) {},
         [this](const std::string& client) {
           transport_diary.add(!clients.empty() && client == clients.back() ? "gone" : "who?");
         }});
  }
  ~LocalPeersOfATransport() override { transport.stop(); }

  Counters counters;
  Diary diary, transport_diary;
  std::vector<std::string> clients;  // of requests
  Transport transport{[] {
                        TransportOptions options;
                        options.bind = "tcp://127.0.0.1:0";
                        options.stream = "tcp://127.0.0.1:0";
                        return options;
                      }(),
                      counters};
};

TEST_F(LocalPeersOfATransport, AskAsOthersDo) {
  const auto number = transport.join(std::make_shared<WritingPeer>(diary), Role::kView);
  transport.ask(number, "one");
  transport.ask(number, "");
  EXPECT_EQ(diary.sorted(4), (Strings{"reply to ", "reply to one", "taken 0", "taken 3"}));
  EXPECT_EQ(transport.unread_bytes(), 0u);
  transport.leave(number);
  EXPECT_EQ(transport_diary.lines(1), Strings{"gone"});
}

TEST_F(LocalPeersOfATransport, GetTheTopicsTheySubscribeTo) {
  const auto number = transport.join(std::make_shared<WritingPeer>(diary), Role::kView);
  const auto other = transport.join(std::make_shared<WritingPeer>(diary), Role::kView);
  transport.subscribe(number, "\x01topic/");
  EXPECT_EQ(diary.sorted(2), (Strings{"taken 7", "topic/x hi"}));
  EXPECT_TRUE(transport.has_subscriber("topic/y"));
  transport.publish("topic/y", {"1", "2"}, TopicSlots::Keep::kOrder);
  transport.publish("other", {"3"});
  EXPECT_EQ(diary.lines(4).back(), "topic/y 2");
  transport.subscribe(number, std::string(1, '\0') + "topic/");
  EXPECT_EQ(diary.lines(5).back(), "taken 7");
  EXPECT_FALSE(transport.has_subscriber("topic/y"));
  transport.leave(other);
}

TEST_F(LocalPeersOfATransport, LoseTheirSubscriptionsAndRepliesWhenTheyLeave) {
  const auto number = transport.join(std::make_shared<WritingPeer>(diary), Role::kView);
  transport.subscribe(number, "\x01topic/");
  transport.ask(number, "silence");
  EXPECT_EQ(diary.lines(3).size(), 3u);
  transport.leave(number);
  EXPECT_EQ(transport_diary.lines(1), Strings{"gone"});
  EXPECT_FALSE(transport.has_subscriber("topic/y"));
  transport.send(Address{{clients.back()}, 0, number}, "too late");
  transport.ask(number, "too late");
  transport.subscribe(number, "\x01topic/");
  const auto next = transport.join(std::make_shared<WritingPeer>(diary), Role::kView);
  EXPECT_NE(next, number);
  transport.ask(next, "next");
  EXPECT_EQ(diary.sorted(5),
            (Strings{"reply to next", "taken 4", "taken 7", "taken 7", "topic/x hi"}));
  EXPECT_EQ(counters.dropped_replies.load(), 1u);
  EXPECT_NE(clients.front(), clients.back());
}

TEST_F(LocalPeersOfATransport, WithTooManySubscriptionsAreToldSo) {
  const auto number = transport.join(std::make_shared<WritingPeer>(diary), Role::kView);
  for (std::size_t i = 0; i <= Subscriptions::kMaxOfOne; ++i)
    transport.subscribe(number, "\x01never " + std::to_string(i));
  const Strings lines = diary.lines(2 * Subscriptions::kMaxOfOne + 2);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), "cut off: too many subscriptions"), 1);
  EXPECT_EQ(counters.cut_off.load(), 1u);
  transport.leave(number);
}

}  // namespace
}  // namespace limber::server
