#pragma once

#include <atomic>
#include <cstdint>

#include "server/transport/latencies.h"

namespace limber::server {

/// Events since the start; shown by GetServerInfo. Any thread may add.
struct Counters {
  std::atomic<std::uint64_t> requests{0};  // messages on the request socket, readable or not
  std::atomic<std::uint64_t> replies{0};   // handed to the socket
  std::atomic<std::uint64_t> errors{0};  // replies that are errors, without waits that are not over
  std::atomic<std::uint64_t> malformed{0};          // of them: unreadable bytes
  std::atomic<std::uint64_t> dropped_requests{0};   // cannot be answered: envelope without end
  std::atomic<std::uint64_t> dropped_replies{0};    // the client has disconnected, or reads nothing
  std::atomic<std::uint64_t> repeated_requests{0};  // that were applied before: answered again
  std::atomic<std::uint64_t> published{0};          // stream messages handed to the socket
  std::atomic<std::uint64_t> replaced{
      0};  // stream messages given up for a newer one of their topic
  std::atomic<std::uint64_t> forced{
      0};  // sent past a subscriber that did not keep up: it missed them
  std::atomic<std::uint64_t> followed{0};  // stream messages sent to followers
  std::atomic<std::uint64_t> stalled{0};   // followers that were cut off: they read nothing
  std::atomic<std::uint64_t> withheld{
      0};  // stream messages that went to no subscriber: too much was unread
  std::atomic<std::uint64_t> refused_handshakes{0};  // CURVE keys not on the list
  std::atomic<std::uint64_t> refused_replies{0};     // too much is unread: an error in their place
  std::atomic<std::uint64_t> parked{0}, brought_back{0};  // sessions, since the start
  std::atomic<std::uint64_t> cut_off{0};  // connections: too many subscriptions, key revoked
  std::atomic<std::uint64_t> web_connections{0};  // WebSockets that are open now
  std::atomic<std::uint64_t> web_refused{0};      // HTTP requests: wrong token, Host or Origin
  std::atomic<std::uint64_t> web_published{0};    // stream messages put into queues of WebSockets
  std::atomic<std::uint64_t> web_queue_bytes{0};  // of those that wait there now
  Latencies acknowledgements;  // of edits: from the arrival of a request to its reply
};

}  // namespace limber::server
