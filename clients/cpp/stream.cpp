#include "clients/cpp/stream.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <utility>

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
    : client_(client),
      instance_(client.instance()),
      socket_(client.context(), ZMQ_SUB),
      orders_(client.context(), ZMQ_PAIR),
      obeyed_(client.context(), ZMQ_PAIR),
      queue_(kQueue) {
  client.configure(socket_);
  // A subscription is sent right after the handshake.
  SocketMonitor handshake(client.context(), socket_, ZMQ_EVENT_HANDSHAKE_SUCCEEDED);
  const std::string address = reachable(endpoint, client.endpoint());
  try {
    socket_.connect(address);
  } catch (const zmq::error_t& error) {
    throw ClientError(v1::ERROR_CODE_INVALID_ARGUMENT, "stream_endpoint",
                      "cannot connect to '" + address + "': " + error.what());
  }
  if (!client.wait_readable(handshake.events(), client.options().timeout))
    throw Unreachable("no stream at " + address);
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

/// Returns when the thread has done it: what is requested afterwards comes later than the
/// subscription.
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
  zmq::pollitem_t items[] = {{socket_.handle(), 0, ZMQ_POLLIN, 0},
                             {obeyed_.handle(), 0, ZMQ_POLLIN, 0}};
  while (true) {
    try {
      zmq::poll(items, 2, Milliseconds{-1});
      if (items[1].revents != 0 && !obey()) return;
      if (items[0].revents != 0) receive();
    } catch (const zmq::error_t& error) {
      if (error.num() != EINTR) throw;
    }
  }
}

bool Subscription::obey() {
  zmq::message_t message;
  if (!obeyed_.recv(message, zmq::recv_flags::dontwait)) return true;
  const std::string text = message.to_string();
  if (text[0] == kSubscribe) socket_.set(zmq::sockopt::subscribe, text.substr(1));
  if (text[0] == kUnsubscribe) socket_.set(zmq::sockopt::unsubscribe, text.substr(1));
  obeyed_.send(zmq::message_t(), zmq::send_flags::none);
  return text[0] != kEnd;
}

void Subscription::receive() {
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
