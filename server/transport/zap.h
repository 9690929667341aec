#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>
#include <zmq.hpp>

#include "server/transport/allow_list.h"
#include "server/transport/connections.h"
#include "server/transport/counters.h"

namespace limber::server {

/// Decides which clients may connect (RFC 27, ZAP), gives each connection its number, and tells of
/// its end: a thread at inproc://zeromq.zap.01 of one context. Without keys every peer of ZMTP 3 is
/// accepted. There it matters that libzmq refuses older peers on sockets that have a ZAP domain:
/// these know no handshake, and any text (HTTP too) looks like one of them.
///
/// Must live before the sockets it guards are bound, and until they are closed.
class ZapHandler {
 public:
  using OnEnd = std::function<void(const EndedConnections&)>;
  /// @param allowed  CURVE clients with other keys, or without one, are answered 400. Nothing: the
  ///                 sockets have no keys.
  /// @param on_end   called on the handler's thread
  ZapHandler(zmq::context_t& context, std::optional<AllowedKeys> allowed, Counters& counters,
             OnEnd on_end);
  ~ZapHandler();
  ZapHandler(const ZapHandler&) = delete;
  ZapHandler& operator=(const ZapHandler&) = delete;

  /// Before the socket is bound: its connections are handed to this handler.
  static void guard(zmq::socket_t& socket);
  /// Before start(): the ends of this socket's connections are reported.
  void watch(zmq::socket_t& socket);
  /// Before the socket is closed, on its thread.
  static void stop_watching(zmq::socket_t& socket);
  /// Before any connection is made.
  void start();

  /// In place of those that were; for handshakes that come. Any thread.
  void allow(AllowedKeys allowed);

 private:
  void run();
  void answer();
  void read_ends();
  [[nodiscard]] std::optional<std::string> refusal_of(const std::vector<zmq::message_t>& request,
                                                      std::string& key) const;

  zmq::context_t& context_;
  zmq::socket_t handler_;                // REP
  zmq::socket_t stop_, stopped_;         // inproc PAIRs: a message ends the thread
  std::vector<zmq::socket_t> monitors_;  // PAIRs
  Counters& counters_;
  const OnEnd on_end_;
  const bool has_keys_;
  std::uint64_t last_ = 0;    // number that was given
  mutable std::mutex mutex_;  // of what follows
  AllowedKeys allowed_;
  std::thread thread_;
};

}  // namespace limber::server
