#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <zmq.hpp>

#include "clients/cpp/client.h"
#include "clients/cpp/credit.h"
#include "clients/cpp/event_queue.h"
#include "clients/cpp/socket_monitor.h"
#include "limber/v1/stream.pb.h"

namespace limber::client {

/// Messages that a server publishes under the requested topics. A thread empties the SUB socket
/// even if nothing is read. libzmq 4.3.4 aborts the process (`_input_stopped`, `!_io_error`) when a
/// socket with a full queue meets a missing heartbeat or the end of the server. The bound is
/// therefore on the queue behind it: of each topic the newest 8 messages. A server that offers it
/// is followed against credit (follow.proto), by a DEALER in place of the SUB socket: unread
/// messages wait there, bounded in bytes. For one thread at a time; must not outlive its client.
class Subscription {
 public:
  /// Connects and waits for the handshake. Subscribe, then request a snapshot, then read: nothing
  /// falls in between.
  /// @param endpoint  as GetServerInfo says; a wildcard host is replaced by the client's
  /// @throws Unreachable if there is no stream
  Subscription(Client& client, const std::string& endpoint);
  /// By what this server offers. @param about  as GetServerInfo answers
  Subscription(Client& client, const v1::GetServerInfoResponse& about);
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;
  ~Subscription();

  void subscribe(const std::string& topic);
  void unsubscribe(const std::string& topic);

  /// The next message of a subscribed topic, or nothing after the timeout. Bytes that are no
  /// message are skipped.
  /// @throws ClientError CANCELLED if interrupted; ServerRestarted for a message of another run of
  /// limberd than the client had heard of when this was made. It is not thrown if the session was
  /// heard of before: it is stored, and continues.
  [[nodiscard]] std::optional<StreamEvent> next(Milliseconds timeout);

  /// Messages lost so far, all topics, up to the one that was read last.
  [[nodiscard]] std::uint64_t missed() const { return missed_; }
  /// Why the server has ended the stream last, in words; empty: it never did. It went on by itself,
  /// with the newest of each topic.
  [[nodiscard]] std::string cut_off() const;

 private:
  enum class Way { kSubscribe, kFollow };
  Subscription(Client& client, const std::string& endpoint, Way way);
  void order(char what, const std::string& topic);
  void run();
  [[nodiscard]] bool obey();
  void receive();
  // For a stream that is followed:
  struct Unanswered {
    std::uint64_t id;
    std::chrono::steady_clock::time_point until;
  };
  void ask();
  void note_connection();
  void receive_followed();
  void note_reply(const zmq::message_t& message);
  void obeyed();
  void push(StreamEvent event);
  [[nodiscard]] bool is_of_another_run(const v1::StreamMessage& message);

  Client& client_;
  const std::string instance_;
  std::set<std::uint64_t> uids_;                   // of sessions that messages of this run were of
  zmq::socket_t socket_;                           // the thread's, once it runs
  std::optional<SocketMonitor> handshakes_;        // of it
  zmq::socket_t orders_, obeyed_;                  // two ends: ours, the thread's
  std::map<std::string, std::uint64_t> sequence_;  // newest by topic; the thread's
  std::optional<Credit> credit_;                   // of a stream that is followed; the thread's
  std::optional<Unanswered> order_;                // whose answer an order waits for; the thread's
  mutable std::mutex mutex_;                       // of the members below
  std::string cut_off_;
  std::optional<v1::Error> refusal_;
  bool is_followed_ = false;  // the first answer was no refusal
  EventQueue queue_;
  std::uint64_t missed_ = 0;
  std::thread thread_;
};

/// Topic of a session's frames in an encoding (UNSPECIFIED: coordinates). Sessions as NAME or
/// NAME@UID.
[[nodiscard]] std::string frames_topic(const std::string& session, v1::Encoding encoding);
/// Topic of changes of frames, in coordinates: MotionBuffer.
[[nodiscard]] std::string changes_topic(const std::string& session);
[[nodiscard]] std::string status_topic(const std::string& session);
[[nodiscard]] std::string design_topic(const std::string& session);
/// The stream's endpoint as a client reaches it that reaches the server's requests at `requests`.
[[nodiscard]] std::string reachable(const std::string& stream, const std::string& requests);

}  // namespace limber::client
