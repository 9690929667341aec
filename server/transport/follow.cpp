// Followers of streams by the request socket: Transport's part for them.

#include <fmt/format.h>

#include <array>
#include <utility>

#include "limber/v1/follow.pb.h"
#include "server/log/log.h"
#include "server/transport/transport.h"

namespace limber::server {
namespace {

using namespace std::chrono_literals;

constexpr auto kTendEvery = 100ms;
// One that waits for shorter is only slow.
constexpr auto kLeastStall = 1s;
// The memory of a connection is free some time after its end.
constexpr auto kRelieveEvery = 200ms;

double seconds(std::chrono::milliseconds time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

void Transport::follow(const Address& address, Following wanted,
                       const std::function<void(const FollowAnswer&)>& answer) {
  auto begun =
      followers_.follow(address, std::move(wanted), ++last_local_peer_, Followers::Clock::now());
  const std::uint64_t number = begun.follower == nullptr ? 0 : begun.follower->number;
  cut_off_displaced();
  answer(begun.answer);
  if (number == 0) return;
  call([this, number, fresh = std::move(begun.fresh)] {
    followers_.note_answer(number);
    for (const auto& topic : fresh) {
      const bool has_newest = topic.after != 0 && topic.after == sequence_of(topic.prefix);
      handlers_.on_subscription(topic.prefix, has_newest ? Has::kNewest : Has::kNothing);
    }
    pump_followers();
  });
}

std::uint64_t Transport::sequence_of(const std::string& topic) {
  const std::lock_guard lock(mutex_);
  const auto found = sequences_.find(topic);
  return found == sequences_.end() ? 0 : found->second;
}

void Transport::pump_followers() {
  if (followers_.empty()) return;
  followers_.pump(
      [this](const auto& follower, auto& message) { return send_now(follower, message); },
      Followers::Clock::now());
}

void Transport::tend_followers() {
  const auto now = Followers::Clock::now();
  if (followers_.empty() || now - tended_ < kTendEvery) return;
  tended_ = now;
  for (const auto* follower : followers_.stalled(options_.stalled_after, now))
    end_follower(*follower, fmt::format("it gave no credit for {:g} s while messages waited",
                                        seconds(options_.stalled_after)));
  pump_followers();  // of some only the network was full
}

/// Too much is unread: ends the follower that has stalled for longest. If none has stalled for a
/// second, all read too slowly: the followers that hold most lose waiting changes that newer ones
/// continue. The newest of a topic stays: nothing might come after it. If that is not enough, the
/// follower that holds most is ended, and gets a snapshot when it comes again.
void Transport::relieve_memory() {
  const auto now = Followers::Clock::now();
  const auto* stalled = followers_.most_stalled(now);
  if (stalled != nullptr && stalled->stream.stalled_for(now) >= kLeastStall)
    return end_follower(*stalled,
                        fmt::format("all streams together left more than {} bytes unread, and this "
                                    "one had given no credit for longest",
                                    options_.stream_total_bytes));
  const std::uint64_t limit = options_.stream_total_bytes;
  while (live_.total() > limit) {
    const std::uint64_t messages = followers_.withhold(limit);
    if (messages == 0) break;
    counters_.replaced.fetch_add(messages, std::memory_order_relaxed);
  }
  if (live_.total() <= limit || now - relieved_ < kRelieveEvery) return;
  const auto* largest = followers_.largest(limit, now);
  if (largest == nullptr) return;
  relieved_ = now;
  end_follower(*largest,
               fmt::format("all streams together left more than {} bytes unread, and most "
                           "of them were this one's",
                           limit));
}

void Transport::end_follower(const Followers::Follower& follower, const std::string& reason) {
  log::warn("cut off {}, which follows streams: {}",
            follower.name.empty() ? "a client" : follower.name, reason);
  counters_.cut_off.fetch_add(1, std::memory_order_relaxed);
  counters_.stalled.fetch_add(1, std::memory_order_relaxed);
  // A proxy that has read everything goes on for the others behind it.
  if (!follower.is_behind_proxy() || follower.stream.unwritten_bytes() > 0)
    connections_.cut_off_client(follower.connection());
  followers_.end(follower, reason);
}

Followers::Sent Transport::send_now(const Followers::Follower& follower,
                                    FollowedStream::Message& message) {
  struct Held {  // until libzmq has written it
    Held(std::shared_ptr<const StreamBytes> given, FollowedStream::Unwritten counted)
        : bytes(std::move(given)), unwritten(std::move(counted)) {}
    const std::shared_ptr<const StreamBytes> bytes;
    const FollowedStream::Unwritten unwritten;
  };
  v1::StreamPosition position;
  position.set_sent_bytes(message.sent_bytes);
  position.set_left_out(message.left_out);
  constexpr auto kMore = zmq::send_flags::sndmore | zmq::send_flags::dontwait;
  try {
    for (const auto& frame : follower.address.envelope) {
      if (!router_.send(zmq::buffer(frame), kMore)) return Followers::Sent::kFull;  // of replies
    }
    router_.send(zmq::buffer(message.topic), kMore);
    const auto held =
        std::make_shared<Held>(std::move(message.bytes), std::move(message.unwritten));
    router_.send(message_of({held, held->bytes.get()}), kMore);
    router_.send(zmq::buffer(position.SerializeAsString()), zmq::send_flags::dontwait);
    counters_.followed.fetch_add(1, std::memory_order_relaxed);
  } catch (const zmq::error_t& fault) {
    if (fault.num() != EHOSTUNREACH) throw;  // disconnected: its end is reported separately
  }
  return Followers::Sent::kYes;
}

}  // namespace limber::server
