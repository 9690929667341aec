#include "clients/cpp/stream.h"

#include <algorithm>
#include <chrono>

#include "clients/cpp/socket_monitor.h"

namespace limber::client {
namespace {

/// Messages that wait in this process for a reader that is slow; a motion may have megabytes.
constexpr int kQueue = 8;

}  // namespace

Subscription::Subscription(Client& client, const std::string& endpoint)
    : client_(client), socket_(client.context(), ZMQ_SUB) {
  client.configure(socket_);
  socket_.set(zmq::sockopt::rcvhwm, kQueue);
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
}

void Subscription::subscribe(const std::string& topic) {
  socket_.set(zmq::sockopt::subscribe, topic);
}

void Subscription::unsubscribe(const std::string& topic) {
  socket_.set(zmq::sockopt::unsubscribe, topic);
}

std::optional<StreamEvent> Subscription::next(Milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const auto left = std::chrono::ceil<Milliseconds>(deadline - std::chrono::steady_clock::now());
    if (!client_.wait_readable(socket_, std::max(left, Milliseconds{0}))) return std::nullopt;
    zmq::message_t topic;
    zmq::message_t body;
    if (!socket_.recv(topic, zmq::recv_flags::dontwait)) continue;
    StreamEvent event{topic.to_string(), {}, 0};
    bool more = topic.more();
    int parts = 1;
    while (more && socket_.recv(body, zmq::recv_flags::dontwait)) {
      more = body.more();
      ++parts;
    }
    if (parts != 2 || !event.message.ParseFromArray(body.data(), static_cast<int>(body.size())))
      continue;
    auto& newest = sequence_[event.topic];
    if (newest != 0 && event.message.sequence() > newest + 1)
      event.missed = event.message.sequence() - newest - 1;
    newest = event.message.sequence();
    missed_ += event.missed;
    return event;
  }
}

std::string frames_topic(const std::string& session, v1::Encoding encoding) {
  const char* name = "coordinates";
  if (encoding == v1::ENCODING_POSITIONS) name = "positions";
  if (encoding == v1::ENCODING_POSITIONS_QUANTISED) name = "quantised";
  return "session/" + session + "/body/0/" + name;
}

std::string status_topic(const std::string& session) { return "session/" + session + "/status"; }

std::string reachable(const std::string& stream, const std::string& requests) {
  const std::string tcp = "tcp://";
  if (!stream.starts_with(tcp) || !requests.starts_with(tcp)) return stream;
  const auto colon = stream.rfind(':');
  const std::string host = stream.substr(tcp.size(), colon - tcp.size());
  if (host != "0.0.0.0" && host != "*" && host != "[::]") return stream;
  return requests.substr(0, requests.rfind(':')) + stream.substr(colon);
}

}  // namespace limber::client
