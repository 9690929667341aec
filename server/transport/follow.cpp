// Those who follow streams by the request socket: Transport's part for them.

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

double seconds(std::chrono::milliseconds time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

FollowAnswer Transport::follow(const Address& address, Following wanted) {
  auto begun =
      followers_.follow(address, std::move(wanted), ++last_local_peer_, Followers::Clock::now());
  cut_off_displaced();
  for (const auto& topic : begun.fresh) {
    if (!begun.answer.is_taken) break;
    const bool has_newest = topic.after != 0 && topic.after == sequence_of(topic.prefix);
    handlers_.on_subscription(topic.prefix, has_newest ? Has::kNewest : Has::kNothing);
  }
  pump_followers();
  return std::move(begun.answer);
}

std::uint64_t Transport::sequence_of(const std::string& topic) {
  const std::lock_guard lock(mutex_);
  const auto found = sequences_.find(topic);
  return found == sequences_.end() ? 0 : found->second;
}

void Transport::pump_followers() {
  if (followers_.empty()) return;
  followers_.pump([this](const auto& follower, auto& message) { send_now(follower, message); },
                  Followers::Clock::now());
}

void Transport::tend_followers() {
  const auto now = Followers::Clock::now();
  if (followers_.empty() || now - tended_ < kTendEvery) return;
  tended_ = now;
  for (const std::string& client : followers_.stalled(options_.stalled_after, now))
    end_follower(client, fmt::format("it gave no credit for {:g} s while messages waited",
                                     seconds(options_.stalled_after)));
  pump_followers();  // of some only the network was full
}

/// What is unread takes too much.
void Transport::relieve_memory() {
  const auto now = Followers::Clock::now();
  const std::string client = followers_.most_stalled(now);
  if (client.empty() || followers_.of_client(client)->stream.stalled_for(now) < kLeastStall) return;
  end_follower(client, fmt::format("all streams together left more than {} bytes unread, and this "
                                   "one had given no credit for longest",
                                   options_.stream_total_bytes));
}

void Transport::end_follower(const std::string& client, const std::string& reason) {
  const auto* follower = followers_.of_client(client);
  log::warn("cut off {}, which follows streams: {}",
            follower == nullptr || follower->name.empty() ? "a client" : follower->name, reason);
  counters_.cut_off.fetch_add(1, std::memory_order_relaxed);
  counters_.stalled.fetch_add(1, std::memory_order_relaxed);
  connections_.cut_off_client(client);
  followers_.end(client, reason);
}

void Transport::send_now(const Followers::Follower& follower, FollowedStream::Message& message) {
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
      if (!router_.send(zmq::buffer(frame), kMore)) return;  // full of replies: it is missed
    }
    router_.send(zmq::buffer(message.topic), kMore);
    const auto held =
        std::make_shared<Held>(std::move(message.bytes), std::move(message.unwritten));
    router_.send(message_of({held, held->bytes.get()}), kMore);
    router_.send(zmq::buffer(position.SerializeAsString()), zmq::send_flags::dontwait);
    counters_.followed.fetch_add(1, std::memory_order_relaxed);
  } catch (const zmq::error_t& fault) {
    if (fault.num() != EHOSTUNREACH) throw;  // gone: its end is told of
  }
}

}  // namespace limber::server
