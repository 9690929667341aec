// What subscribers and followers send, against what is published meanwhile. The first byte chooses:
//   b  a stream and its queue: bytes that each are a step (put, send, find the network full, read,
//      give up, begin again)
//   s  steps of several clients, as bytes: subscriptions as libzmq hands them on, FollowRequests,
//      some by a proxy, ends of connections, publications, some to full connections, relief
#include <algorithm>
#include <cstring>
#include <deque>
#include <map>
#include <string>

#include "server/transport/following.h"
#include "server/transport/subscriptions.h"
#include "server/wire/wire_check.h"
#include "tests/fuzz/decoding.h"
#include "tests/fuzz/input.h"

namespace {

using namespace limber;
namespace proto = limber::v1;
using Clock = server::FollowedStream::Clock;
using Keep = server::TopicSlots::Keep;

constexpr Clock::time_point kNow{};
constexpr std::uint64_t kQueueBytes = 4096;
constexpr std::string_view kTopics[] = {"a", "ab", "abc", "b"};

/// Bytes of an input from first to last; behind the last there are zeros.
class Steps {
 public:
  explicit Steps(std::string_view bytes) : bytes_(bytes) {}
  [[nodiscard]] bool at_end() const { return bytes_.empty(); }
  unsigned take() {
    const std::string_view byte = take(1);
    return byte.empty() ? 0 : static_cast<unsigned char>(byte.front());
  }
  std::string_view take(std::size_t count) {
    const std::string_view part = bytes_.substr(0, count);
    bytes_.remove_prefix(part.size());
    return part;
  }
  server::SharedMessages messages() {
    std::vector<server::StreamBytes> all(take() % 4);
    for (auto& bytes : all) bytes.assign(take() * std::size_t{64}, 'x');
    return server::shared(std::move(all));
  }
  std::string topic() { return std::string(kTopics[take() % std::size(kTopics)]); }
  Keep keep() { return static_cast<Keep>(take() % 3); }

 private:
  std::string_view bytes_;
};

/// One stream beside a count of what was put into it: each message is sent once or counted as left
/// out.
class CountedStream {
 public:
  CountedStream() { stream_.set_window(1); }
  void put(Steps& steps) {
    const std::string topic = steps.topic();
    const auto messages = steps.messages();
    put_ += messages->size();
    stream_.put(topic, messages, steps.keep(), kNow);
  }
  void send() {
    while (auto message = stream_.next(kNow)) {
      const std::uint64_t bytes = message->topic.size() + message->bytes->size();
      if (message->sent_bytes != sent_bytes_ + bytes)
        fuzz::finding("a position is not that of the one before and its message");
      if (stream_.unread_bytes() >= stream_.window() + bytes)
        fuzz::finding("more is sent than the window and a message");
      sent_bytes_ = message->sent_bytes;
      under_way_.push_back(sent_bytes_);
    }
  }
  /// So often the network is full.
  void send_in_vain(unsigned times) {
    for (; times > 0; --times) {
      auto message = stream_.next(kNow);
      if (!message) return;
      const auto bytes = message->bytes;
      const std::uint64_t position = message->sent_bytes;
      stream_.put_back(std::move(*message), kNow);
      auto again = stream_.next(kNow);
      if (!again || again->bytes != bytes || again->sent_bytes != position)
        fuzz::finding("what was put back is not the next one");
      stream_.put_back(std::move(*again), kNow);
      if (stream_.unread_bytes() > 0 && under_way_.empty())
        fuzz::finding("what was put back is unread");
    }
  }
  void give_up() {
    const bool waits = stream_.waiting_bytes() > 0;
    const std::uint64_t before = stream_.left_out();
    if (before + stream_.give_up_spare() != stream_.left_out())
      fuzz::finding("what was given up is not what was counted");
    if (stream_.has_spare() || waits != (stream_.waiting_bytes() > 0))
      fuzz::finding("too little was given up, or all");
  }
  /// How far a client says to be, which may be a lie.
  std::uint64_t position(Steps& steps) {
    std::uint64_t position = 0;
    const unsigned what = steps.take();
    if (what < 200) return what < under_way_.size() ? under_way_[what] : sent_bytes_;
    const std::string_view bytes = steps.take(sizeof position);
    if (!bytes.empty()) std::memcpy(&position, bytes.data(), bytes.size());
    return position;
  }
  void read(std::uint64_t position) {
    stream_.credit(position, kNow);
    note_read(position);
  }
  void begin_again(std::uint64_t position) {
    stream_.suspend();
    if (stream_.waiting_bytes() != 0) fuzz::finding("a stream without a connection has messages");
    stream_.resume(position, kNow);
    note_read(position);
    lost_ += under_way_.size();
    under_way_.clear();
    if (stream_.unread_bytes() != 0) fuzz::finding("a new connection has unread bytes");
  }
  void set_window(std::uint64_t bytes) { stream_.set_window(bytes); }
  /// All that waits is sent: then nothing is unaccounted for.
  void finish() {
    while (stream_.waiting_bytes() > 0) {
      send();
      read(sent_bytes_);
    }
    if (stream_.left_out() < lost_ || put_ + lost_ != stream_.sent() + stream_.left_out())
      fuzz::finding("a message is neither sent nor left out");
  }

 private:
  void note_read(std::uint64_t position) {
    while (!under_way_.empty() && under_way_.front() <= position) under_way_.pop_front();
  }
  server::FollowedStream stream_{kQueueBytes};
  std::deque<std::uint64_t> under_way_;  // positions of what is sent and not read
  std::uint64_t put_ = 0, sent_bytes_ = 0, lost_ = 0;
};

void step_stream(Steps steps) {
  CountedStream stream;
  while (!steps.at_end()) {
    switch (steps.take() % 7) {
      case 0:
      case 1:
        stream.put(steps);
        break;
      case 2:
        stream.read(stream.position(steps));
        break;
      case 3:
        stream.begin_again(stream.position(steps));
        break;
      case 5:
        stream.put(steps);
        stream.send_in_vain(steps.take() % 4);
        break;
      case 6:
        stream.give_up();
        break;
      default:
        stream.set_window(steps.take() * std::uint64_t{1024});
        break;
    }
    stream.send();
  }
  stream.finish();
}

/// Clients of both kinds, four of each.
class Clients {
 public:
  void subscribe(Steps& steps) {
    const std::uint64_t client = 1 + steps.take() % 4;
    const std::string_view message = steps.take(steps.take());
    const auto noted = subscriptions_.note(client, message);
    if (noted != server::Subscriptions::Noted::kSubscription) return;
    if (!subscriptions_.is_subscribed(client, message.substr(1)))
      fuzz::finding("a subscription was noted, but is none");
  }
  void follow(Steps& steps) {
    const unsigned who = steps.take();
    std::vector<std::string> envelope{std::string(1, static_cast<char>('A' + who % 4))};
    for (unsigned behind = who / 4 % 4; behind > 0; --behind)
      envelope.emplace_back(behind - 1, 'p');
    const std::string_view bytes = steps.take(steps.take());
    fuzz::answers([&] {
      proto::FollowRequest request;
      server::check_wire(bytes, *proto::FollowRequest::descriptor());
      if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
        throw server::malformed("no request");
      const server::Address address{std::move(envelope), 0, 0, server::Role::kView, ""};
      const auto begun =
          followers_.follow(address, server::following_of(request, "run"), ++last_, kNow);
      // One that ended, or was not there, counts from 0.
      if (begun.follower == nullptr || !begun.answer.continued)
        positions_.erase('\n' + request.stream());
      if (begun.follower == nullptr) return;
      followers_.note_answer(begun.follower->number);
      for (const auto& topic : begun.fresh) {
        if (!subscriptions_.is_subscribed(begun.follower->number, topic.prefix))
          fuzz::finding("a follower was told that it gets what it does not get");
      }
    });
  }
  void end(Steps& steps) {
    const unsigned client = steps.take() % 8;
    if (client < 4) return subscriptions_.forget(1 + client);
    followers_.end_connection(std::string(1, static_cast<char>('A' + client - 4)),
                              "its connection had ended");
  }
  /// @param most  messages that the network takes
  void publish(Steps& steps, unsigned most = ~0u) {
    const std::string topic = steps.topic();
    const auto messages = steps.messages();
    followers_.publish(topic, messages, steps.keep(), kNow);
    followers_.pump(
        [&](const auto& follower, const auto& message) {
          if (most == 0) return server::Followers::Sent::kFull;
          --most;
          std::uint64_t& before = positions_[follower.key];
          if (message.sent_bytes <= before) fuzz::finding("a position that is not behind the last");
          before = message.sent_bytes;
          return server::Followers::Sent::kYes;
        },
        kNow);
  }
  /// Messages are given up as long as there are any, then the largest follower.
  void relieve(Steps& steps) {
    const std::uint64_t limit = steps.take() * std::uint64_t{64};
    while (followers_.withhold(limit) > 0) {
    }
    const auto* largest = followers_.largest(limit, kNow);
    if (largest == nullptr) return;
    if (largest->stream.held_bytes() == 0) fuzz::finding("the largest holds nothing");
    followers_.end(*largest, "too much was unread");
  }
  void end_all() {
    for (std::uint64_t client = 1; client <= 4; ++client) subscriptions_.forget(client);
    for (char client = 'A'; client <= 'D'; ++client)
      followers_.end_connection(std::string(1, client), "the end");
    if (!followers_.empty()) fuzz::finding("a follower is left");
    for (const std::string_view topic : kTopics) {
      if (subscriptions_.has_subscriber(topic)) fuzz::finding("a subscription is left");
    }
  }

 private:
  server::Subscriptions subscriptions_;
  server::Followers followers_{kQueueBytes, subscriptions_};
  std::uint64_t last_ = 100;
  std::map<std::string, std::uint64_t> positions_;
};

void step_clients(Steps steps) {
  Clients clients;
  while (!steps.at_end()) {
    switch (steps.take() % 6) {
      case 0:
        clients.subscribe(steps);
        break;
      case 1:
        clients.follow(steps);
        break;
      case 2:
        clients.end(steps);
        break;
      case 4:
        clients.publish(steps, steps.take() % 4);
        break;
      case 5:
        clients.relieve(steps);
        break;
      default:
        clients.publish(steps);
        break;
    }
  }
  clients.end_all();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes = fuzz::text_of(data, size);
  if (bytes.starts_with('b')) step_stream(Steps(bytes.substr(1)));
  if (bytes.starts_with('s')) step_clients(Steps(bytes.substr(1)));
  return 0;
}
