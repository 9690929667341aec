#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <zmq.hpp>

#include "clients/cpp/client.h"
#include "clients/cpp/event_queue.h"
#include "limber/v1/stream.pb.h"

namespace limber::client {

/// What a server publishes under the topics asked for. A thread empties the SUB socket whether
/// anybody reads or not: libzmq 4.3.4 aborts the process (`_input_stopped`, `!_io_error`) when a
/// socket whose queue is full meets a missing heartbeat or the end of the server. So the bound is
/// on the queue behind it: of each topic the newest 8 messages. For one thread at a time; must not
/// outlive its client.
class Subscription {
 public:
  /// Connects and waits for the handshake. Subscribe, then request a snapshot, then read: nothing
  /// falls in between.
  /// @param endpoint  as GetServerInfo says; a wildcard host is replaced by the client's
  /// @throws Unreachable if there is no stream
  Subscription(Client& client, const std::string& endpoint);
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;
  ~Subscription();

  void subscribe(const std::string& topic);
  void unsubscribe(const std::string& topic);

  /// The next message of a subscribed topic, or nothing after the timeout. Bytes that are no
  /// message are skipped.
  /// @throws ClientError CANCELLED if interrupted; ServerRestarted for a message of another run of
  /// limberd than the client had heard of when this was made, unless its session was heard of
  /// before: it is stored, and goes on
  [[nodiscard]] std::optional<StreamEvent> next(Milliseconds timeout);

  /// Messages lost so far, all topics, up to the one that was read last.
  [[nodiscard]] std::uint64_t missed() const { return missed_; }

 private:
  void order(char what, const std::string& topic);
  void run();
  [[nodiscard]] bool obey();
  void receive();
  [[nodiscard]] bool is_of_another_run(const v1::StreamMessage& message);

  Client& client_;
  const std::string instance_;
  std::set<std::uint64_t> uids_;                   // of sessions that messages of this run were of
  zmq::socket_t socket_;                           // the thread's, once it runs
  zmq::socket_t orders_, obeyed_;                  // two ends: ours, the thread's
  std::map<std::string, std::uint64_t> sequence_;  // newest by topic; the thread's
  EventQueue queue_;
  std::uint64_t missed_ = 0;
  std::thread thread_;
};

/// Topic of a session's frames in an encoding (UNSPECIFIED: coordinates). Sessions as NAME or
/// NAME@UID.
[[nodiscard]] std::string frames_topic(const std::string& session, v1::Encoding encoding);
/// Topic of what changes of them, in coordinates: MotionBuffer.
[[nodiscard]] std::string changes_topic(const std::string& session);
[[nodiscard]] std::string status_topic(const std::string& session);
[[nodiscard]] std::string design_topic(const std::string& session);
/// The stream's endpoint as a client reaches it that reaches the server's requests at `requests`.
[[nodiscard]] std::string reachable(const std::string& stream, const std::string& requests);

}  // namespace limber::client
