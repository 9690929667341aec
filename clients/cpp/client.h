#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <zmq.hpp>

#include "clients/cpp/error.h"
#include "clients/cpp/rpc.h"
#include "clients/cpp/socket_monitor.h"

namespace limber::client {

using Milliseconds = std::chrono::milliseconds;

/// CURVE, as Z85 text of 40 characters each: the server's public key and this client's pair.
struct CurveKeys {
  std::string server;
  std::string public_key;
  std::string secret_key;
};

struct ClientOptions {
  Milliseconds timeout{10000};  // > 0: for answers to requests that wait for nothing themselves
  std::optional<CurveKeys> keys;
  /// Name shown to others in a session, at most 64 bytes; empty: limberd finds a name.
  std::string client_name;
  /// Asked about ten times a second while waiting; true ends the wait with CANCELLED.
  std::function<bool()> interrupted;

  void validate() const;
};

inline constexpr std::uint32_t kProtocolVersion = 1;
inline constexpr const char* kDefaultEndpoint = "tcp://127.0.0.1:7801";

/// 32 hexadecimal digits, of the operating system's randomness.
[[nodiscard]] std::string random_id();

/// Requests to one limberd over a DEALER socket. Any number may be in flight; replies are matched
/// by id, in any order. For one thread at a time.
///
/// Lazy Pirate (zguide, chapter 4): a request has a deadline. If it passes and the server was
/// silent meanwhile, the socket is closed and opened again, so that nothing queued for a dead
/// server reaches the next one. A request is sent once more, under the same id, if the connection
/// was lost and is there again, and after half of its time. The server applies changes once and
/// answers again; the first answer counts. If a server refuses a request at its end, for another
/// run to execute it, the request is sent to that run, within its time and ClientOptions::timeout.
///
/// A restart of limberd is reported by ServerRestarted: requests that name a session are meant for
/// the run that instance() says, or, as NAME@UID, for that very session.
class Client {
 public:
  /// Connects; nothing is sent. @throws ClientError INVALID_ARGUMENT for a malformed endpoint,
  /// options or keys
  explicit Client(std::string endpoint = kDefaultEndpoint, ClientOptions options = {});
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// One request, one response; a long one comes in parts (parts.proto), of which each has the
  /// time. @throws ClientError of the server's refusal; Unreachable if it is silent
  template <class RequestBody>
  typename Rpc<RequestBody>::Response call(const RequestBody& body,
                                           std::optional<Milliseconds> timeout = {}) {
    v1::Request request;
    Rpc<RequestBody>::put(request, body);
    v1::Reply reply = ask(request, timeout.value_or(options_.timeout), Rpc<RequestBody>::kName);
    return taken<RequestBody>(reply);
  }

  /// Sends a request and returns its id at once; collect() its answer later, in any order.
  template <class RequestBody>
  std::uint64_t submit(const RequestBody& body) {
    v1::Request request;
    Rpc<RequestBody>::put(request, body);
    send(stamped(request).bytes);
    return last_id_;
  }

  /// The answer to a submitted request. @throws as call(); the request is forgotten then
  template <class RequestBody>
  typename Rpc<RequestBody>::Response collect(std::uint64_t id,
                                              std::optional<Milliseconds> timeout = {}) {
    v1::Reply reply =
        receive(id, timeout.value_or(options_.timeout), Rpc<RequestBody>::kName, nullptr);
    return taken<RequestBody>(reply);
  }

  /// Forgets a submitted request; its answer will be dropped.
  void abandon(std::uint64_t id);

  [[nodiscard]] const std::string& endpoint() const { return endpoint_; }
  /// The run of limberd that plain names of sessions refer to: that of the first answer. It is a
  /// later one once a restart was reported, or a session was opened there. Empty before any answer.
  [[nodiscard]] const std::string& instance() const { return instance_; }
  [[nodiscard]] const ClientOptions& options() const { return options_; }
  [[nodiscard]] zmq::context_t& context() { return context_; }

  /// Waits until the socket can be read, in slices that notice an interruption. False once the time
  /// is over.
  /// @throws ClientError CANCELLED if interrupted
  bool wait_readable(zmq::socket_t& socket, Milliseconds timeout) const;
  /// Options that every socket of a client has in common.
  void configure(zmq::socket_t& socket) const;

 private:
  /// A request, to be sent again.
  struct Again {
    std::string bytes;
    bool is_for_next_run;  // not of a job, which ends with its run
  };

  template <class RequestBody>
  static typename Rpc<RequestBody>::Response taken(v1::Reply& reply) {
    if (!Rpc<RequestBody>::is(reply)) refuse_kind(Rpc<RequestBody>::kName);
    return Rpc<RequestBody>::take(reply);
  }

  /// A request and its reply, which comes in parts (parts.proto) where it may be long.
  v1::Reply ask(v1::Request& request, Milliseconds timeout, const char* what);
  v1::Reply ask_once(v1::Request& request, Milliseconds timeout, const char* what);
  /// The reply whose first part came in its place.
  v1::Reply fetch_rest(v1::GetReplyPartResponse first, Milliseconds timeout, const char* what);
  /// A request with the next id, which is in flight from now on.
  Again stamped(v1::Request& request);
  void send(const std::string& bytes);
  /// @param again  sent once more after half of the time, and to the run that follows one that
  /// ends; null: nothing
  v1::Reply receive(std::uint64_t id, Milliseconds timeout, const char* what, const Again* again);
  /// Reads one message, of whichever request it answers.
  void receive_one();
  void note_instance(const v1::Reply& reply);
  [[noreturn]] static void refuse_kind(const char* what);
  void open_socket();
  /// Whether the connection was lost and is there again since this was asked last.
  bool is_connected_anew();

  std::string endpoint_;
  ClientOptions options_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::optional<SocketMonitor> connections_;  // of it
  bool was_connected_ = false;
  const std::string id_;  // by which limberd knows repeated requests, also on a new connection
  std::string instance_;
  std::string without_parts_;  // the run of an older limberd, whose answers do not come in parts
  std::string heard_instance_;
  std::uint64_t last_id_ = 0;
  std::map<std::uint64_t, std::optional<v1::Reply>> pending_;  // submitted and not collected yet
  std::uint64_t heard_ = 0;                                    // messages received so far
};

/// Starts with GetServerInfo, asked once: whether a server is there, and whether it speaks our
/// protocol.
/// @throws Unreachable; ClientError UNSUPPORTED for another protocol
[[nodiscard]] v1::GetServerInfoResponse greet(Client& client,
                                              std::optional<Milliseconds> timeout = {});

}  // namespace limber::client
