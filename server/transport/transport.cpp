#include "server/transport/transport.h"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "server/log/log.h"
#include "server/transport/endpoint.h"
#include "server/transport/ipc_claim.h"
#include "server/transport/zap.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr int kLingerMs = 500;
// Buffer of a connection in the kernel (which takes twice as many): as much of a large message is
// copied at a time. Acknowledgements to others wait for that copy, since libzmq has one thread for
// all. A network of 50 ms still gets 10 MB/s.
constexpr int kSendBytes = 256 << 10;
// Followers get the reason before they are cut off.
constexpr std::chrono::seconds kLaterThanFollowers{5};
constexpr int kRequestsPerRound = 256;  // then replies and streams get their turn
constexpr std::size_t kMaxTopics = 100'000;
constexpr std::size_t kCopiedBytes = 16u << 10;  // of a stream message; larger ones are shared
constexpr int kSubscriptionsPerRound = 256;
// Longer ones match no topic of ours, and libzmq spends some 30 bytes on each of their bytes. The
// handshake counts, too: that of CURVE takes 350.
constexpr int kSubscriptionBytes = 192, kSubscriptionBytesWithKeys = 512;

void add(std::atomic<std::uint64_t>& counter, std::uint64_t amount = 1) {
  counter.fetch_add(amount, std::memory_order_relaxed);
}

void bind_socket(zmq::socket_t& socket, const std::string& endpoint, const char* option) {
  const IpcClaim claim(endpoint, option);
  if (endpoint.find('[') != std::string::npos) socket.set(zmq::sockopt::ipv6, true);
  try {
    socket.bind(for_bind(endpoint));
  } catch (const zmq::error_t& fault) {
    throw Error(ErrorCode::kIo, option, fmt::format("cannot bind {}: {}", endpoint, fault.what()));
  }
}

void secure(zmq::socket_t& socket, const std::optional<CurveSetup>& curve) {
  ZapHandler::guard(socket);
  if (!curve) return;
  socket.set(zmq::sockopt::curve_server, true);
  socket.set(zmq::sockopt::curve_secretkey, curve->server.secret_key);
}

/// @param unmoved  how long a connection may be full without the peer's system taking a byte
void tune(zmq::socket_t& socket, std::chrono::milliseconds unmoved) {
  // A peer that stopped reading in the middle of a message: libzmq gets no ping out behind it, and
  // waits for ever. The kernel counts (TCP_USER_TIMEOUT).
  socket.set(zmq::sockopt::tcp_maxrt, static_cast<int>(unmoved.count()));
  socket.set(zmq::sockopt::sndbuf, kSendBytes);
  socket.set(zmq::sockopt::linger, kLingerMs);
  socket.set(zmq::sockopt::handshake_ivl, 5000);
  socket.set(zmq::sockopt::heartbeat_ivl, 5000);
  socket.set(zmq::sockopt::heartbeat_timeout, 15000);
  socket.set(zmq::sockopt::tcp_keepalive, 1);
}

void append_sequence(StreamBytes& bytes, std::uint64_t sequence) {
  bytes.push_back(0x10);  // StreamMessage.sequence = 2, varint: fields may come in any order
  for (; sequence >= 0x80; sequence >>= 7)
    bytes.push_back(static_cast<char>((sequence & 0x7f) | 0x80));
  bytes.push_back(static_cast<char>(sequence));
}

}  // namespace

void TransportOptions::validate() const {
  for (const auto& [endpoint, option] :
       {std::pair{bind, "--bind"}, std::pair{stream, "--stream"}}) {
    if (reach_of(endpoint, option) == Reach::kBeyond && !curve) {
      throw invalid(
          option,
          fmt::format(
              "{} reaches beyond this machine: that needs --curve-secret-file and --curve-allow",
              endpoint));
    }
  }
  // If the system chooses the port or path, equal addresses are two different ones.
  if (for_bind(bind) == for_bind(stream) && !for_bind(bind).ends_with('*'))
    throw invalid("--stream", fmt::format("{} is the address of --bind, too", stream));
  if (request_queue <= 0) throw invalid("request_queue", "must be > 0");
  if (reply_queue <= 0) throw invalid("reply_queue", "must be > 0");
  if (stream_queue <= 0) throw invalid("--stream-queue", "must be > 0");
  if (stream_bytes == 0) throw invalid("--max-stream-bytes", "must be > 0");
  if (stream_total_bytes == 0) throw invalid("--max-stream-total-bytes", "must be > 0");
  if (stalled_after.count() <= 0) throw invalid("--stalled-after", "must be > 0");
  if (message_bytes < 1024) throw invalid("--max-message-bytes", "must be >= 1024");
  if (message_bytes > (1ull << 30)) throw invalid("--max-message-bytes", "must be <= 1 GiB");
  if (unread_total_bytes < message_bytes)
    throw invalid("--max-unread-total-bytes", "must be >= --max-message-bytes");
}

Transport::Transport(TransportOptions options, Counters& counters)
    : options_(std::move(options)),
      counters_(counters),
      unread_({options_.unread_bytes, options_.unread_total_bytes}),
      context_(1),
      slots_(options_.patience),
      followers_(options_.stream_bytes, subscriptions_) {
  options_.validate();
  // One thread of the context: it reports events in their order.
  zap_ = std::make_unique<ZapHandler>(
      context_, options_.curve ? std::optional(options_.curve->allowed) : std::nullopt, counters_,
      [this](const EndedConnections& ended) { enqueue(ended); });
  router_ = zmq::socket_t(context_, ZMQ_ROUTER);
  xpub_ = zmq::socket_t(context_, ZMQ_XPUB);
  for (auto* socket : {&router_, &xpub_}) {
    tune(*socket, options_.stalled_after + kLaterThanFollowers);
    secure(*socket, options_.curve);
  }
  router_.set(zmq::sockopt::router_mandatory, 1);
  router_.set(zmq::sockopt::sndhwm, options_.reply_queue);
  router_.set(zmq::sockopt::rcvhwm, options_.request_queue);
  // Beyond the limit there is room for an answer that reports it; only far beyond it the peer is
  // cut off.
  router_.set(zmq::sockopt::maxmsgsize,
              static_cast<std::int64_t>(2 * options_.message_bytes + (1 << 20)));
  xpub_.set(zmq::sockopt::sndhwm, options_.stream_queue);
  xpub_.set(zmq::sockopt::maxmsgsize,
            std::int64_t{options_.curve ? kSubscriptionBytesWithKeys : kSubscriptionBytes});
  // Every subscriber is heard, not only the first and the last of a topic.
  xpub_.set(zmq::sockopt::xpub_verboser, true);
  xpub_.set(zmq::sockopt::xpub_nodrop, true);
  for (auto* socket : {&router_, &xpub_}) zap_->watch(*socket);
  wake_fd_ = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake_fd_ < 0) throw Error(ErrorCode::kInternal, "", "no eventfd");
  zap_->start();
  bind_socket(router_, options_.bind, "--bind");
  bind_socket(xpub_, options_.stream, "--stream");
  request_endpoint_ = router_.get(zmq::sockopt::last_endpoint);
  stream_endpoint_ = xpub_.get(zmq::sockopt::last_endpoint);
}

Transport::~Transport() {
  stop();
  zap_.reset();
  if (wake_fd_ >= 0) ::close(wake_fd_);
}

void Transport::start(TransportHandlers handlers) {
  handlers_ = std::move(handlers);
  thread_ = std::thread([this] { loop(); });
}

void Transport::stop() {
  stopping_.store(true);
  wake();
  if (thread_.joinable()) {
    thread_.join();
  } else {
    close_sockets();
  }
}

void Transport::close_sockets() {
  for (auto* socket : {&router_, &xpub_}) {
    if (socket->handle() == nullptr) continue;
    ZapHandler::stop_watching(*socket);
    socket->close();
  }
}

void Transport::send(Address address, std::string bytes) {
  const std::string& client = address.envelope.front();
  UnreadReplies::Excess excess;
  auto unread = unread_.admit(client, bytes.size(), excess);
  if (!unread) {
    bytes = handlers_.overflow_reply(address, excess);
    unread = unread_.admit_error(client, bytes.size());
    add(counters_.refused_replies);
  }
  if (!unread) {
    add(counters_.dropped_replies);
    return;
  }
  enqueue(Outgoing{std::move(address), std::move(bytes), std::move(*unread)});
}

void Transport::allow(AllowedKeys keys) { enqueue(NewKeys{std::move(keys)}); }

void Transport::publish(const std::string& topic, std::vector<StreamBytes> messages,
                        TopicSlots::Keep keep) {
  // If this copies, it does so before the lock, since acknowledgements would wait.
  for (auto& bytes : messages) bytes.reserve(bytes.size() + kSequenceBytes);
  {
    const std::lock_guard lock(mutex_);
    // A long life sees many sessions; forgetting their counts only means that they begin at 1
    // again.
    if (sequences_.size() >= kMaxTopics) sequences_.clear();
    std::uint64_t& sequence = sequences_[topic];
    for (auto& bytes : messages) append_sequence(bytes, ++sequence);
    queue_.emplace_back(Publication{topic, live_.counted(std::move(messages)), keep});
  }
  wake();
}

void Transport::enqueue(Item item) {
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(item));
  }
  wake();
}

void Transport::wake() const {
  if (std::this_thread::get_id() == thread_id_.load(std::memory_order_relaxed))
    return;  // it looks by itself
  signal();
}

void Transport::signal() const {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(wake_fd_, &one, sizeof one);
}

void Transport::loop() {
  thread_id_.store(std::this_thread::get_id());
  std::array<zmq::pollitem_t, 3> items{{{router_.handle(), 0, ZMQ_POLLIN, 0},
                                        {xpub_.handle(), 0, ZMQ_POLLIN, 0},
                                        {nullptr, wake_fd_, ZMQ_POLLIN, 0}}};
  using namespace std::chrono_literals;
  while (!stopping_.load()) {
    try {
      zmq::poll(items.data(), items.size(), slots_.empty() ? 1000ms : 1ms);
      std::uint64_t count = 0;
      if ((items[2].revents & ZMQ_POLLIN) != 0) {
        [[maybe_unused]] const auto got = ::read(wake_fd_, &count, sizeof count);
      }
      if ((items[1].revents & ZMQ_POLLIN) != 0) receive_subscriptions();
      if ((items[0].revents & ZMQ_POLLIN) != 0) receive_requests();
      drain();
      tend_followers();
    } catch (const zmq::error_t& fault) {
      if (fault.num() == ETERM) break;
      if (fault.num() != EINTR) log::error("transport: {}", fault.what());
    } catch (const std::exception&
                 fault) {  // out of memory: the message in progress is lost, the loop is not
      log::error("transport: {}", fault.what());
    }
  }
  try {
    drain();
    slots_.flush([this](const auto& topic, const auto& bytes,
                        auto) { return publish_now(topic, bytes, TopicSlots::Force::kYes); },
                 TopicSlots::Clock::now());
  } catch (const std::exception& fault) {
    log::error("transport: {}", fault.what());
  }
  close_sockets();
}

void Transport::drain() {
  std::vector<Item> items;
  {
    const std::lock_guard lock(mutex_);
    items.swap(queue_);
  }
  bool may_have_queued = false;
  for (auto& item : items) {
    if (auto* outgoing = std::get_if<Outgoing>(&item)) {
      send_now(*outgoing);
    } else if (const auto* publication = std::get_if<Publication>(&item)) {
      publish_now(*publication);
    } else if (const auto* ended = std::get_if<EndedConnections>(&item)) {
      end_connections(*ended);
    } else if (auto* event = std::get_if<LocalEvent>(&item)) {
      apply(*event);
      may_have_queued = true;
    } else if (const auto* called = std::get_if<Call>(&item)) {
      try {
        called->task();
      } catch (const std::exception& fault) {  // the rest of the queue is others'
        log::error("transport: {}", fault.what());
      }
      may_have_queued = true;
    } else {
      apply(std::get<NewKeys>(item));
    }
  }
  if (!slots_.empty()) flush_slots();
  // Entries that came meanwhile are for the next round, after the sockets had their turn.
  if (may_have_queued) signal();
}

void Transport::publish_now(const Publication& publication) {
  local_peers_.publish(publication.topic, publication.messages, publication.keep, subscriptions_);
  add(counters_.replaced, followers_.publish(publication.topic, publication.messages,
                                             publication.keep, Followers::Clock::now()));
  pump_followers();
  if (live_.total() > options_.stream_total_bytes) {
    relieve_memory();
    const auto& messages = *publication.messages;
    const bool is_large = std::any_of(messages.begin(), messages.end(), [](const auto& message) {
      return message.size() >= kCopiedBytes;
    });
    if (is_large) {
      add(counters_.withheld, messages.size());
      return;
    }
  }
  add(counters_.replaced, slots_.put(publication.topic, publication.messages,
                                     TopicSlots::Clock::now(), publication.keep));
  flush_slots();  // in the order of publication while no subscriber is full
}

void Transport::flush_slots() {
  slots_.flush([this](const std::string& topic, const std::shared_ptr<const StreamBytes>& bytes,
                      TopicSlots::Force force) { return publish_now(topic, bytes, force); },
               TopicSlots::Clock::now());
}

void Transport::end_connections(const EndedConnections& ended) {
  const auto connection = connections_.end(ended);
  if (!connection) return;
  subscriptions_.forget(connection->number);
  if (!connection->client.empty()) end_client(connection->client);
}

void Transport::end_client(const std::string& client) {
  followers_.end_connection(
      client, "its connection had ended; one without a sign of life is given up after 20 s");
  handlers_.on_disconnected(client);
}

void Transport::apply(NewKeys& allowed) {
  if (!options_.curve) return;
  options_.curve->allowed = allowed.keys;
  zap_->allow(std::move(allowed.keys));
  add(counters_.cut_off, connections_.cut_off_others(options_.curve->allowed));
}

bool Transport::is_revoked(const Peer& peer) {
  if (!options_.curve || options_.curve->allowed.contains(peer.key)) return false;
  // Only of one that let the handshake be done before the list was changed.
  Connections::cut_off(peer);
  return true;
}

/// Without keys, the sockets are only reachable from this machine.
Role Transport::role_of(const Peer& peer) const {
  if (!options_.curve) return Role::kAdminister;
  const auto known = options_.curve->allowed.find(peer.key);
  return known == options_.curve->allowed.end() ? Role::kView : known->second.role;
}

TopicSlots::Sent Transport::publish_now(const std::string& topic,
                                        const std::shared_ptr<const StreamBytes>& bytes,
                                        TopicSlots::Force force) {
  // Large ones are not copied: they count as unread until libzmq lets them go.
  const auto body = [&bytes] {
    if (bytes->size() < kCopiedBytes) return zmq::message_t(bytes->data(), bytes->size());
    return message_of(bytes);
  };
  auto sent = xpub_.send(zmq::buffer(topic), zmq::send_flags::sndmore | zmq::send_flags::dontwait);
  if (!sent && force == TopicSlots::Force::kYes) {
    add(counters_.forced);
    xpub_.set(zmq::sockopt::xpub_nodrop, false);
    sent = xpub_.send(zmq::buffer(topic), zmq::send_flags::sndmore | zmq::send_flags::dontwait);
    xpub_.send(body(), zmq::send_flags::dontwait);
    xpub_.set(zmq::sockopt::xpub_nodrop, true);
  } else if (!sent) {
    return TopicSlots::Sent::kFull;
  } else {
    xpub_.send(body(), zmq::send_flags::dontwait);
  }
  add(counters_.published);
  return TopicSlots::Sent::kYes;
}

void Transport::receive_requests() {
  for (int i = 0; i < kRequestsPerRound && receive_request(); ++i) {
  }
}

bool Transport::receive_request() {
  constexpr std::size_t kMaxFrames = 16;
  std::vector<std::string> frames;
  zmq::message_t frame;
  bool too_many = false;
  while (true) {
    if (!router_.recv(frame, zmq::recv_flags::dontwait)) return false;
    if (!frame.more()) break;
    if (frames.size() < kMaxFrames) {
      frames.push_back(frame.to_string());
    } else {
      too_many = true;
    }
  }
  // The ends of connections that had its descriptor were queued before its handshake was answered:
  // they are noted before it is.
  drain();
  const Peer peer = peer_of(frame);
  if (is_revoked(peer)) {
    add(counters_.dropped_requests);
    return true;
  }
  add(counters_.requests);
  // [routing id] payload, or [routing id] ... [empty] payload. Frames in between are sent back
  // unchanged.
  if (too_many || frames.empty()) {
    add(counters_.dropped_requests);
    return true;
  }
  const std::string client = frames.front();
  if (connections_.note_client(peer, client)) end_client(client);
  handlers_.on_request(Address{std::move(frames), 0, 0, role_of(peer), peer.key}, std::move(frame));
  if (connections_.note(peer) == Connections::State::kEnded) end_client(client);
  return true;
}

void Transport::receive_subscriptions() {
  zmq::message_t message;
  for (int i = 0; i < kSubscriptionsPerRound; ++i) {
    if (!xpub_.recv(message, zmq::recv_flags::dontwait)) return;
    drain();  // as in receive_request()
    const Peer peer = peer_of(message);
    if (is_revoked(peer) || connections_.note(peer) == Connections::State::kEnded) continue;
    switch (subscriptions_.note(peer.number, message.to_string_view())) {
      case Subscriptions::Noted::kSubscription:
        cut_off_displaced();
        handlers_.on_subscription(std::string(message.to_string_view().substr(1)), Has::kNothing);
        break;
      case Subscriptions::Noted::kTooMany:
        log::warn("cut off a subscriber with more than {} prefixes", Subscriptions::kMaxOfOne);
        add(counters_.cut_off);
        Connections::cut_off(peer);
        break;
      case Subscriptions::Noted::kNothing:
        cut_off_displaced();
        break;
    }
  }
}

void Transport::cut_off_displaced() {
  for (const std::uint64_t connection : subscriptions_.take_displaced()) {
    log::warn("cut off the subscriber with most prefixes: all together had {}",
              Subscriptions::kMaxPrefixes);
    add(counters_.cut_off);
    const std::string reason = "all subscribers together have too many prefixes";
    if (const auto* follower = followers_.of_number(connection)) {
      end_follower(*follower, reason);
    } else if (!cut_off_local_peer(connection, reason)) {
      connections_.cut_off(connection);
    }
  }
}

void Transport::send_now(Outgoing& outgoing) {
  struct Held {  // lives until libzmq has written the bytes: so it is known what a client leaves
                 // unread
    std::string bytes;
    UnreadReplies::Hold unread;
  };
  const auto& envelope = outgoing.address.envelope;
  if (outgoing.address.local_peer != 0) return send_to_local_peer(outgoing);
  try {
    for (std::size_t i = 0; i < envelope.size(); ++i) {
      const auto flags = zmq::send_flags::sndmore | zmq::send_flags::dontwait;
      if (!router_.send(zmq::buffer(envelope[i]), flags)) {
        add(counters_.dropped_replies);  // its queue is full: it reads nothing
        return;
      }
    }
    auto* held = new Held{std::move(outgoing.bytes), std::move(outgoing.unread)};
    zmq::message_t message(
        held->bytes.data(), held->bytes.size(),
        [](void*, void* hint) { delete static_cast<Held*>(hint); }, held);
    router_.send(std::move(message), zmq::send_flags::dontwait);
    add(counters_.replies);
  } catch (const zmq::error_t& fault) {
    if (fault.num() != EHOSTUNREACH) throw;
    add(counters_.dropped_replies);
    handlers_.on_gone(envelope.front());
  }
}

}  // namespace limber::server
