#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>
#include <zmq.hpp>

#include "server/transport/role.h"
#include "server/transport/subscriptions.h"
#include "server/transport/topic_slots.h"
#include "server/transport/unread_replies.h"

namespace limber::server {

/// A client that is connected to this process by other means than the two sockets, a page's
/// WebSocket for one. Its requests are handled like those of the sockets. Called on the transport's
/// thread: must be quick, and must not call back.
class LocalPeer {
 public:
  LocalPeer() = default;
  virtual ~LocalPeer() = default;
  LocalPeer(const LocalPeer&) = delete;
  LocalPeer& operator=(const LocalPeer&) = delete;

  /// A request or subscription of so many bytes has left the transport's queue.
  virtual void taken(std::size_t bytes) = 0;
  /// @param unread  to be kept until the bytes are written to the network
  virtual void reply(std::string bytes, UnreadReplies::Hold unread) = 0;
  /// A peer that cannot send yet keeps messages as `keep` requires; it delays no other peer.
  virtual void publish(const std::string& topic, const SharedMessages& messages,
                       TopicSlots::Keep keep) = 0;
  /// It has too many subscriptions; its messages are ignored from now on.
  virtual void cut_off(const std::string& reason) = 0;
};

/// Those that there are, by number. Not thread-safe.
class LocalPeers {
 public:
  /// Connections of the sockets are numbered from 1 (ZapHandler).
  static constexpr std::uint64_t kFirstNumber = 1ull << 63;

  void add(std::uint64_t number, std::shared_ptr<LocalPeer> peer, Role role);
  /// @returns its client (see client_of()); empty if it was not there
  std::string remove(std::uint64_t number);
  [[nodiscard]] LocalPeer* find(std::uint64_t number) const;
  [[nodiscard]] Role role_of(std::uint64_t number) const;
  /// In the place of a routing id: random, so that no peer of the sockets can take it.
  [[nodiscard]] const std::string& client_of(std::uint64_t number) const;
  /// To all that subscribe to the topic.
  void publish(const std::string& topic, const SharedMessages& messages, TopicSlots::Keep keep,
               const Subscriptions& subscriptions) const;

 private:
  struct Known {
    std::shared_ptr<LocalPeer> peer;
    std::string client;
    Role role = Role::kView;
  };
  std::unordered_map<std::uint64_t, Known> peers_;
};

/// An action of a local peer, in their order.
struct LocalEvent {
  enum class What { kJoins, kAsks, kSubscribes, kLeaves };
  std::uint64_t number = 0;
  What what = What::kJoins;
  std::shared_ptr<LocalPeer> peer;  // joins
  Role role = Role::kView;          // joins
  zmq::message_t bytes;             // asks, subscribes
};

/// A message that takes the bytes over.
[[nodiscard]] zmq::message_t message_of(std::string bytes);
/// A message of these bytes, which are shared until libzmq lets it go.
[[nodiscard]] zmq::message_t message_of(std::shared_ptr<const StreamBytes> bytes);

}  // namespace limber::server
