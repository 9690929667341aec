#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>
#include <zmq.hpp>

#include "server/transport/allow_list.h"

namespace limber::server {

/// A connection of one of the two sockets: the number that its handshake was given (ZapHandler),
/// never given again, and its file descriptor, which the next connection may have.
struct Peer {
  std::uint64_t number = 0;  // 0: unknown
  int file = -1;
  std::string key;  // its CURVE public key, Z85; empty without CURVE
};

/// Who sent a message.
[[nodiscard]] Peer peer_of(zmq::message_t& message);

/// The user id of a ZAP reply, from which peer_of() reads number and key.
[[nodiscard]] std::string user_id_of(std::uint64_t number, const std::string& key);

/// All connections with this descriptor and a number below `before` have ended.
struct EndedConnections {
  int file;
  std::uint64_t before;
};

/// Which connections are there, and which client is at which. Messages of a connection may be read
/// after its end. Not thread-safe.
class Connections {
 public:
  enum class State { kOpen, kEnded };

  /// A message came by this connection.
  State note(const Peer& peer);
  /// A request did. @returns whether that client (its routing id) had another connection before,
  /// which has ended then
  bool note_client(const Peer& peer, const std::string& client);

  struct Ended {
    std::uint64_t number = 0;
    std::string client;  // empty: none is known that has no newer connection
  };
  /// @returns the connection, if it has been noted
  std::optional<Ended> end(const EndedConnections& ended);

  /// Ends the network connection; libzmq notices, and end() follows. The descriptor is libzmq's:
  /// between its end and the notice of it another file may have it. If that is a socket of another
  /// client, that client is cut off and connects again; nothing else can be shut down so.
  static void cut_off(const Peer& peer);
  /// The open one with this number, if there is one.
  void cut_off(std::uint64_t number) const;
  /// The open one of this client, if there is one.
  void cut_off_client(const std::string& client) const;
  /// Cuts off connections whose key is not allowed. @returns their number
  std::size_t cut_off_others(const AllowedKeys& allowed);

 private:
  struct Known {
    Peer peer;
    std::string client;
  };
  std::unordered_map<int, Known> by_file_;
  std::unordered_map<int, std::uint64_t> ended_before_;        // by descriptor
  std::unordered_map<std::string, std::uint64_t> of_clients_;  // numbers of the open ones
};

}  // namespace limber::server
