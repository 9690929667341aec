#include "clients/cpp/stream.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <utility>
#include <vector>

#include "clients/cpp/session_reference.h"
#include "clients/cpp/socket_monitor.h"

namespace limber::client {
namespace {

/// Messages of one topic that wait for a reader that is slow; a motion may have megabytes.
constexpr std::size_t kQueue = 8;
constexpr Milliseconds kSliceOfReceiving{100};
/// Commands to the thread, a letter before the topic.
constexpr char kSubscribe = '+', kUnsubscribe = '-', kEnd = '.';

}  // namespace

Subscription::Subscription(Client& client, const std::string& endpoint)
    : Subscription(client, endpoint, Way::kSubscribe) {}

Subscription::Subscription(Client& client, const v1::GetServerInfoResponse& about)
    : Subscription(client,
                   about.follow_endpoint().empty() ? about.stream_endpoint() : client.endpoint(),
                   about.follow_endpoint().empty() ? Way::kSubscribe : Way::kFollow) {}

Subscription::Subscription(Client& client, const std::string& endpoint, Way way)
    : client_(client),
      instance_(client.instance()),
      socket_(client.context(), way == Way::kFollow ? ZMQ_DEALER : ZMQ_SUB),
      orders_(client.context(), ZMQ_PAIR),
      obeyed_(client.context(), ZMQ_PAIR),
      queue_(kQueue) {
  client.configure(socket_);
  // A subscription is sent right after the handshake.
  handshakes_.emplace(client.context(), socket_, ZMQ_EVENT_HANDSHAKE_SUCCEEDED);
  const std::string address = reachable(endpoint, client.endpoint());
  try {
    socket_.connect(address);
  } catch (const zmq::error_t& error) {
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "stream_endpoint",
                      "cannot connect to '" + address + "': " + error.what());
  }
  if (!client.wait_readable(handshakes_->events(), client.options().timeout))
    throw Unreachable("no stream at " + address);
  (void)handshakes_->receive();
  if (way == Way::kFollow) {
    credit_.emplace(client.options().client_name);
  } else {
    handshakes_.reset();
  }
  static std::atomic<unsigned> count{0};
  const std::string inside = "inproc://limber-subscription-" + std::to_string(++count);
  orders_.set(zmq::sockopt::linger, 0);
  obeyed_.set(zmq::sockopt::linger, 0);
  obeyed_.bind(inside);
  orders_.connect(inside);
  thread_ = std::thread([this] { run(); });
}

Subscription::~Subscription() {
  order(kEnd, "");
  thread_.join();
}

void Subscription::subscribe(const std::string& topic) { order(kSubscribe, topic); }

void Subscription::unsubscribe(const std::string& topic) { order(kUnsubscribe, topic); }

/// Returns when the thread has done it: later requests come after the subscription.
void Subscription::order(char what, const std::string& topic) {
  const std::string text = what + topic;
  const auto patiently = [](const auto& attempt) {
    while (true) {
      try {
        if (attempt()) return;
      } catch (const zmq::error_t& error) {
        if (error.num() != EINTR) throw;
      }
    }
  };
  zmq::message_t done;
  patiently([&] { return orders_.send(zmq::buffer(text), zmq::send_flags::none).has_value(); });
  patiently([&] { return orders_.recv(done).has_value(); });
}

void Subscription::run() {
  std::vector<zmq::pollitem_t> items{{socket_.handle(), 0, ZMQ_POLLIN, 0},
                                     {obeyed_.handle(), 0, ZMQ_POLLIN, 0}};
  if (handshakes_) items.push_back({handshakes_->events().handle(), 0, ZMQ_POLLIN, 0});
  while (true) {
    try {
      zmq::poll(items, order_ ? kSliceOfReceiving : Milliseconds{-1});
      if (items[1].revents != 0 && !obey()) return;
      if (items[0].revents != 0) receive();
      if (handshakes_ && items[2].revents != 0) note_connection();
      if (order_ && std::chrono::steady_clock::now() >= order_->until) obeyed();
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) throw;
    }
  }
}

bool Subscription::obey() {
  zmq::message_t message;
  if (!obeyed_.recv(message, zmq::recv_flags::dontwait)) return true;
  const std::string text = message.to_string();
  const std::string topic = text.substr(1);
  if (text[0] == kEnd) {
    obeyed();
    return false;
  }
  if (credit_) {
    if (text[0] == kSubscribe) credit_->want(topic);
    if (text[0] == kUnsubscribe) credit_->leave(topic);
    ask();
    order_ = {credit_->id(), std::chrono::steady_clock::now() + client_.options().timeout};
    return true;
  }
  if (text[0] == kSubscribe) socket_.set(zmq::sockopt::subscribe, topic);
  if (text[0] == kUnsubscribe) socket_.set(zmq::sockopt::unsubscribe, topic);
  obeyed();
  return true;
}

void Subscription::obeyed() {
  order_.reset();
  obeyed_.send(zmq::message_t(), zmq::send_flags::none);
}

void Subscription::ask() {
  const std::string request = credit_->request();
  // If there is no connection, the next one asks.
  (void)socket_.send(zmq::buffer(request), zmq::send_flags::dontwait);
}

/// Another one: reports this client's position to the server.
void Subscription::note_connection() {
  while (handshakes_->receive() != 0) continue;
  while ((socket_.get(zmq::sockopt::events) & ZMQ_POLLIN) != 0) receive_followed();
  ask();
}

void Subscription::receive_followed() {
  constexpr std::size_t kParts = 3;
  std::vector<zmq::message_t> parts(1);
  if (!socket_.recv(parts.back(), zmq::recv_flags::dontwait)) return;
  while (parts.back().more()) {
    zmq::message_t part;
    if (!socket_.recv(part, zmq::recv_flags::dontwait)) break;
    parts.push_back(std::move(part));
  }
  if (parts.size() == 1) return note_reply(parts.front());
  StreamEvent event{parts.front().to_string(), {}, 0};
  v1::StreamPosition position;
  const auto parse = [](auto& message, const zmq::message_t& part) {
    return message.ParseFromArray(part.data(), static_cast<int>(part.size()));
  };
  if (parts.size() != kParts || !parse(event.message, parts[1]) || !parse(position, parts[2]))
    return;
  if (credit_->note(event.topic, event.message, position)) ask();
  push(std::move(event));
}

void Subscription::note_reply(const zmq::message_t& message) {
  v1::Reply reply;
  if (!reply.ParseFromArray(message.data(), static_cast<int>(message.size()))) return;
  {
    const std::lock_guard lock(mutex_);
    if (reply.has_follow()) {
      credit_->note(reply.follow());
      is_followed_ = true;
    }
    // Once it has begun, a server that ends or has no room for a reply does not end it: the next
    // handshake asks again.
    const bool is_of_now = reply.error().code() == v1::ERROR_CODE_SHUTTING_DOWN ||
                           reply.error().code() == v1::ERROR_CODE_LIMIT_EXCEEDED;
    if (reply.has_error() && !(is_followed_ && is_of_now)) refusal_ = reply.error();
    cut_off_ = credit_->cut_off();
  }
  if (order_ && reply.id() >= order_->id) obeyed();
}

std::string Subscription::cut_off() const {
  const std::lock_guard lock(mutex_);
  return cut_off_;
}

void Subscription::receive() {
  if (credit_) return receive_followed();
  zmq::message_t topic;
  zmq::message_t body;
  if (!socket_.recv(topic, zmq::recv_flags::dontwait)) return;
  StreamEvent event{topic.to_string(), {}, 0};
  bool more = topic.more();
  int parts = 1;
  while (more && socket_.recv(body, zmq::recv_flags::dontwait)) {
    more = body.more();
    ++parts;
  }
  if (parts != 2 || !event.message.ParseFromArray(body.data(), static_cast<int>(body.size())))
    return;
  push(std::move(event));
}

void Subscription::push(StreamEvent event) {
  auto& newest = sequence_[event.topic];
  if (newest != 0 && event.message.sequence() > newest + 1)
    event.missed = event.message.sequence() - newest - 1;
  newest = event.message.sequence();
  queue_.push(std::move(event));
}

std::optional<StreamEvent> Subscription::next(Milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    if (client_.options().interrupted && client_.options().interrupted())
      throw ClientError(v1::ERROR_CODE_CANCELLED, "", "interrupted");
    const auto left =
        std::max(Milliseconds{0},
                 std::chrono::ceil<Milliseconds>(deadline - std::chrono::steady_clock::now()));
    if (auto event = queue_.pop(std::min(left, kSliceOfReceiving))) {
      if (is_of_another_run(event->message))
        throw ServerRestarted(v1::ERROR_CODE_RESTARTED, "",
                              "limberd was restarted: sessions and jobs of before are gone");
      missed_ += event->missed;
      return event;
    }
    {
      const std::lock_guard lock(mutex_);
      if (refusal_) throw_refusal(*refusal_);
    }
    if (left == Milliseconds{0}) return std::nullopt;
  }
}

/// A session that its server has stored goes on under its uid; jobs and others do not.
bool Subscription::is_of_another_run(const v1::StreamMessage& message) {
  const std::uint64_t uid = message.session_uid();
  const bool is_ours =
      instance_.empty() || message.instance().empty() || message.instance() == instance_;
  if (is_ours && uid != 0) uids_.insert(uid);
  return !is_ours && !uids_.contains(uid);
}

std::string frames_topic(const std::string& session, v1::Encoding encoding) {
  const char* name = "coordinates";
  if (encoding == v1::ENCODING_POSITIONS) name = "positions";
  if (encoding == v1::ENCODING_POSITIONS_QUANTISED) name = "quantised";
  if (encoding == v1::ENCODING_SURFACE) name = "surface";
  return "session/" + session_name(session) + "/body/0/" + name;
}

std::string changes_topic(const std::string& session) {
  return "session/" + session_name(session) + "/body/0/changes";
}

std::string status_topic(const std::string& session) {
  return "session/" + session_name(session) + "/status";
}

std::string design_topic(const std::string& session) {
  return "session/" + session_name(session) + "/design";
}

std::string reachable(const std::string& stream, const std::string& requests) {
  const std::string tcp = "tcp://";
  if (!stream.starts_with(tcp) || !requests.starts_with(tcp)) return stream;
  const auto colon = stream.rfind(':');
  const std::string host = stream.substr(tcp.size(), colon - tcp.size());
  if (host != "0.0.0.0" && host != "*" && host != "[::]") return stream;
  return requests.substr(0, requests.rfind(':')) + stream.substr(colon);
}

}  // namespace limber::client
