#pragma once

#include <map>
#include <optional>
#include <string>
#include <zmq.hpp>

#include "clients/cpp/client.h"
#include "limber/v1/stream.pb.h"

namespace limber::client {

/// A message of the stream.
struct StreamEvent {
  std::string topic;
  v1::StreamMessage message;
  /// Messages of this topic lost just before this one, by the gap in their sequence numbers.
  std::uint64_t missed = 0;
};

/// A SUB socket on the server's stream. For one thread at a time; must not outlive its client.
class Subscription {
 public:
  /// Connects and waits for the handshake. Subscribe, then request a snapshot, then read: nothing
  /// falls in between.
  /// @param endpoint  as GetServerInfo says; a wildcard host is replaced by the client's
  /// @throws Unreachable if there is no stream
  Subscription(Client& client, const std::string& endpoint);

  void subscribe(const std::string& topic);
  void unsubscribe(const std::string& topic);

  /// The next message of a subscribed topic, or nothing after the timeout. Bytes that are no
  /// message are skipped.
  [[nodiscard]] std::optional<StreamEvent> next(Milliseconds timeout);

  /// Messages lost so far, all topics.
  [[nodiscard]] std::uint64_t missed() const { return missed_; }

 private:
  Client& client_;
  zmq::socket_t socket_;
  std::map<std::string, std::uint64_t> sequence_;  // newest by topic
  std::uint64_t missed_ = 0;
};

/// Topic of a session's frames in an encoding (UNSPECIFIED: coordinates).
[[nodiscard]] std::string frames_topic(const std::string& session, v1::Encoding encoding);
[[nodiscard]] std::string status_topic(const std::string& session);
/// The stream's endpoint as a client reaches it that reaches the server's requests at `requests`.
[[nodiscard]] std::string reachable(const std::string& stream, const std::string& requests);

}  // namespace limber::client
