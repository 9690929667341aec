#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <variant>
#include <vector>
#include <zmq.hpp>

#include "server/transport/address.h"
#include "server/transport/connections.h"
#include "server/transport/counters.h"
#include "server/transport/curve.h"
#include "server/transport/followers.h"
#include "server/transport/live_bytes.h"
#include "server/transport/local_peers.h"
#include "server/transport/subscriptions.h"
#include "server/transport/topic_slots.h"
#include "server/transport/unread_replies.h"

namespace limber::server {

class ZapHandler;

struct TransportOptions {
  std::string bind = "tcp://127.0.0.1:7801";    // requests (ROUTER)
  std::string stream = "tcp://127.0.0.1:7802";  // streams (XPUB)
  std::uint64_t message_bytes =
      256ull << 20;  // larger requests are refused; from twice this on the peer is cut off
  std::uint64_t unread_bytes = 512ull << 20;      // replies one client may leave unread
  std::uint64_t unread_total_bytes = 2ull << 30;  // and all together
  int request_queue = 1000;                       // requests per client that wait to be read, > 0
  // Replies per client, > 0; those past it are lost. More than a client has unanswered: a thousand
  // waits may end at once, and small edits are not counted. Their bytes are bounded by
  // unread_bytes.
  int reply_queue = 100'000;
  int stream_queue = 4;  // messages per subscriber, > 0
  // Stream messages that may wait for one follower; a publication more may wait. > 0
  std::uint64_t stream_bytes = 64ull << 20;
  // Limit of unread bytes over all followers, each message counted once. Beyond it, each
  // publication cuts off a follower that has stalled for at least a second. If none has, the
  // largest lose changes that newer ones continue, then their connections; subscribers get no large
  // ones. > 0
  std::uint64_t stream_total_bytes = 1ull << 30;
  // A follower that gives no credit for so long while messages wait is cut off. > 0
  std::chrono::milliseconds stalled_after{30'000};
  std::chrono::milliseconds patience{20};  // how long one full subscriber may hold up a topic
  std::optional<CurveSetup> curve;

  /// @throws Refusal naming the option: bad endpoints, beyond loopback without CURVE
  void validate() const;
};

/// Called on the transport's own thread: must be quick, may call send() and publish().
struct TransportHandlers {
  std::function<void(Address address, zmq::message_t payload)> on_request;
  std::function<void(const std::string& prefix, Has has)> on_subscription;
  /// A short reply in place of one that passes a limit of unread bytes. Any thread.
  std::function<std::string(const Address& address, const UnreadReplies::Excess& excess)>
      overflow_reply;
  /// A reply found its client disconnected. Earlier requests of that client may still come.
  std::function<void(const std::string& client)> on_gone = [](const std::string&) {};
  /// A client's connection has ended. Called again after each request of it that comes later.
  std::function<void(const std::string& client)> on_disconnected = [](const std::string&) {};
};

/// The two sockets and the one thread that owns them. Others hand over through a queue and wake it
/// by an eventfd.
class Transport {
 public:
  /// Binds. @throws Refusal or Error{kIo} naming the option.
  Transport(TransportOptions options, Counters& counters);
  ~Transport();
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  void start(TransportHandlers handlers);
  /// Sends queued messages, then closes the sockets (they linger for at most half a second).
  /// Idempotent.
  void stop();

  [[nodiscard]] const std::string& request_endpoint() const { return request_endpoint_; }
  [[nodiscard]] const std::string& stream_endpoint() const { return stream_endpoint_; }

  // Any thread:
  void send(Address address, std::string bytes);
  /// Bytes of a reply that is kept for a client to fetch count as unread by it; nothing: there is
  /// no room.
  [[nodiscard]] std::optional<UnreadReplies::Hold> hold_kept(const std::string& client,
                                                             std::uint64_t bytes) {
    return unread_.admit_kept(client, bytes);
  }
  /// @param messages  serialised StreamMessages without `sequence`, which is appended here, in the
  /// order of calls
  void publish(const std::string& topic, std::vector<StreamBytes> messages,
               TopicSlots::Keep keep = TopicSlots::Keep::kNewest);
  [[nodiscard]] bool has_subscriber(std::string_view topic) const {
    return subscriptions_.has_subscriber(topic);
  }
  // Followers (follow.proto). On the transport's thread, of a client of the request socket:
  /// @param answer  sends the answer, before all messages of a stream that begins with it; its
  /// exceptions pass through
  void follow(const Address& address, Following wanted,
              const std::function<void(const FollowAnswer&)>& answer);
  // Any thread:
  [[nodiscard]] std::uint64_t stream_bytes() const { return live_.total(); }
  [[nodiscard]] std::vector<FollowerUse> follower_uses(std::size_t most) const {
    return followers_.uses(most, Followers::Clock::now());
  }
  [[nodiscard]] std::size_t follower_count() const { return followers_.size(); }
  /// Clients (routing ids) and their unread bytes, the largest first.
  [[nodiscard]] std::vector<UnreadReplies::Use> unread_uses(std::size_t most) const {
    return unread_.uses(most);
  }
  /// With CURVE: these clients in place of those that were allowed. Connections of others are cut
  /// off before anything is sent that is handed over later.
  void allow(AllowedKeys keys);
  [[nodiscard]] std::uint64_t unread_bytes() const { return unread_.total(); }
  /// On the transport's thread, in turn. Not where it stops before.
  void call(std::function<void()> task) { enqueue(Call{std::move(task)}); }

  // Clients that come by other ways than the two sockets. Any thread, also before start().
  /// @returns its number, by which it asks until it leaves
  std::uint64_t join(std::shared_ptr<LocalPeer> peer, Role role);
  /// @param payload  as a request of the request socket, without frames before it
  void ask(std::uint64_t peer, std::string payload);
  /// @param message  as from the XPUB socket: 1 or 0, then the prefix
  void subscribe(std::uint64_t peer, std::string message);
  /// As the end of a network connection. Its messages before are handled.
  void leave(std::uint64_t peer);

 private:
  struct Outgoing {
    Address address;
    std::string bytes;
    UnreadReplies::Hold unread;
  };
  struct NewKeys {
    AllowedKeys keys;
  };
  struct Publication {
    std::string topic;
    SharedMessages messages;
    TopicSlots::Keep keep;
  };
  struct Call {
    std::function<void()> task;
  };
  using Item = std::variant<Outgoing, Publication, EndedConnections, NewKeys, LocalEvent, Call>;

  void enqueue(Item item);
  void wake() const;
  void signal() const;  // as wake(), also to the thread itself
  void loop();
  void drain();
  void close_sockets();
  void send_now(Outgoing& outgoing);
  void end_connections(const EndedConnections& ended);
  void end_client(const std::string& client);
  void apply(NewKeys& allowed);
  void publish_now(const Publication& publication);
  void flush_slots();
  // follow.cpp
  void pump_followers();
  void tend_followers();
  void relieve_memory();
  void end_follower(const Followers::Follower& follower, const std::string& reason);
  Followers::Sent send_now(const Followers::Follower& follower, FollowedStream::Message& message);
  [[nodiscard]] std::uint64_t sequence_of(const std::string& topic);
  // local_events.cpp
  void apply(LocalEvent& event);
  void receive_local_request(LocalEvent& event);
  void receive_local_subscription(LocalEvent& event);
  void send_to_local_peer(Outgoing& outgoing);
  bool cut_off_local_peer(std::uint64_t number, const std::string& reason);
  /// @returns whether its key was taken off the list; it is cut off then
  bool is_revoked(const Peer& peer);
  [[nodiscard]] Role role_of(const Peer& peer) const;
  void receive_requests();
  bool receive_request();
  void receive_subscriptions();
  void cut_off_displaced();
  TopicSlots::Sent publish_now(const std::string& topic,
                               const std::shared_ptr<const StreamBytes>& bytes,
                               TopicSlots::Force force);
  TransportOptions options_;
  Counters& counters_;
  TransportHandlers handlers_;
  UnreadReplies unread_;  // messages of the context hold parts of it
  LiveBytes live_;
  zmq::context_t context_;
  std::unique_ptr<ZapHandler> zap_;
  zmq::socket_t router_, xpub_;
  std::string request_endpoint_, stream_endpoint_;
  int wake_fd_ = -1;
  Subscriptions subscriptions_;
  TopicSlots slots_;         // the thread's
  Connections connections_;  // the thread's
  LocalPeers local_peers_;   // the thread's
  Followers followers_;      // the thread's, but for what says how they do
  Followers::Clock::time_point tended_, relieved_;
  std::atomic<std::uint64_t> last_local_peer_{LocalPeers::kFirstNumber};
  std::thread thread_;
  std::atomic<std::thread::id> thread_id_{};
  std::atomic<bool> stopping_{false};

  std::mutex mutex_;  // of what follows
  std::vector<Item> queue_;
  std::unordered_map<std::string, std::uint64_t> sequences_;
};

}  // namespace limber::server
