// Events of clients that do not use the two sockets: Transport's part for them.

#include <utility>

#include "server/log/log.h"
#include "server/transport/transport.h"

namespace limber::server {

std::uint64_t Transport::join(std::shared_ptr<LocalPeer> peer, Role role) {
  const std::uint64_t number = ++last_local_peer_;
  enqueue(LocalEvent{number, LocalEvent::What::kJoins, std::move(peer), role, {}});
  return number;
}

void Transport::ask(std::uint64_t peer, std::string payload) {
  enqueue(LocalEvent{peer, LocalEvent::What::kAsks, nullptr, {}, message_of(std::move(payload))});
}

void Transport::subscribe(std::uint64_t peer, std::string message) {
  enqueue(
      LocalEvent{peer, LocalEvent::What::kSubscribes, nullptr, {}, message_of(std::move(message))});
}

void Transport::leave(std::uint64_t peer) {
  enqueue(LocalEvent{peer, LocalEvent::What::kLeaves, nullptr, {}, {}});
}

void Transport::apply(LocalEvent& event) {
  switch (event.what) {
    case LocalEvent::What::kJoins:
      local_peers_.add(event.number, std::move(event.peer), event.role);
      break;
    case LocalEvent::What::kAsks:
      receive_local_request(event);
      break;
    case LocalEvent::What::kSubscribes:
      receive_local_subscription(event);
      break;
    case LocalEvent::What::kLeaves:
      subscriptions_.forget(event.number);
      if (const std::string client = local_peers_.remove(event.number); !client.empty())
        handlers_.on_disconnected(client);
      break;
  }
}

void Transport::receive_local_request(LocalEvent& event) {
  LocalPeer* const peer = local_peers_.find(event.number);
  if (peer == nullptr) return;
  counters_.requests.fetch_add(1, std::memory_order_relaxed);
  const std::size_t bytes = event.bytes.size();
  handlers_.on_request(Address{{local_peers_.client_of(event.number)},
                               0,
                               event.number,
                               local_peers_.role_of(event.number),
                               {}},
                       std::move(event.bytes));
  peer->taken(bytes);
}

void Transport::receive_local_subscription(LocalEvent& event) {
  LocalPeer* const peer = local_peers_.find(event.number);
  if (peer == nullptr) return;
  const std::string_view message = event.bytes.to_string_view();
  const auto noted = subscriptions_.note(event.number, message);
  cut_off_displaced();
  if (noted == Subscriptions::Noted::kTooMany) {
    log::warn("cut off a page with more than {} prefixes", Subscriptions::kMaxOfOne);
    counters_.cut_off.fetch_add(1, std::memory_order_relaxed);
    peer->cut_off("too many subscriptions");
  } else if (noted == Subscriptions::Noted::kSubscription) {
    handlers_.on_subscription(std::string(message.substr(1)), Has::kNothing);
  }
  peer->taken(message.size());
}

bool Transport::cut_off_local_peer(std::uint64_t number, const std::string& reason) {
  LocalPeer* const peer = local_peers_.find(number);
  if (peer != nullptr) peer->cut_off(reason);
  return peer != nullptr;
}

void Transport::send_to_local_peer(Outgoing& outgoing) {
  if (LocalPeer* const peer = local_peers_.find(outgoing.address.local_peer)) {
    peer->reply(std::move(outgoing.bytes), std::move(outgoing.unread));
    counters_.replies.fetch_add(1, std::memory_order_relaxed);
  } else {
    counters_.dropped_replies.fetch_add(1, std::memory_order_relaxed);
    handlers_.on_gone(outgoing.address.envelope.front());
  }
}

}  // namespace limber::server
