#include "clients/cpp/reach.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>

namespace limber::client {
namespace {

/// A refused client is let go without a word, as often as it comes: what it sees is a connection
/// without a handshake. `HANDSHAKE_FAILED_...` is said for some of the reasons only.
constexpr int kEvents = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_CONNECT_RETRIED |
                        ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                        ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                        ZMQ_EVENT_DISCONNECTED;

/// An event is two frames: number and value, then the address.
std::uint16_t receive_event(zmq::socket_t& events) {
  zmq::message_t frame, address;
  std::uint16_t event = 0;
  if (!events.recv(frame, zmq::recv_flags::dontwait)) return event;
  if (frame.size() >= sizeof event) std::memcpy(&event, frame.data(), sizeof event);
  if (frame.more()) (void)events.recv(address, zmq::recv_flags::dontwait);
  return event;
}

}  // namespace

Reach probe(Client& client, Milliseconds patience) {
  static std::atomic<unsigned> count{0};
  const std::string address = "inproc://limber-reach-" + std::to_string(++count);
  zmq::socket_t socket(client.context(), ZMQ_DEALER);
  client.configure(socket);
  zmq_socket_monitor(socket.handle(), address.c_str(), kEvents);
  zmq::socket_t events(client.context(), ZMQ_PAIR);
  events.set(zmq::sockopt::linger, 0);
  events.connect(address);
  socket.connect(client.endpoint());
  const auto deadline = std::chrono::steady_clock::now() + patience;
  Reach reach = Reach::kNobody;
  for (bool decided = false; !decided;) {
    const auto left = std::chrono::ceil<Milliseconds>(deadline - std::chrono::steady_clock::now());
    if (!client.wait_readable(events, std::max(left, Milliseconds{0}))) break;
    const std::uint16_t event = receive_event(events);
    if (event == 0) continue;
    decided = event != ZMQ_EVENT_CONNECTED;
    if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED)
      reach = Reach::kHandshake;
    else if (event != ZMQ_EVENT_CONNECT_RETRIED)
      reach = Reach::kNoHandshake;
  }
  zmq_socket_monitor(socket.handle(), nullptr, 0);
  return reach;
}

std::string advice(Reach reach, const Client& client) {
  switch (reach) {
    case Reach::kNobody:
      return "nothing listens there";
    case Reach::kHandshake:
      return "something lets this client in, but is busy or hangs";
    case Reach::kNoHandshake:
      break;
  }
  if (!client.options().keys)
    return "something listens there, but does not let in a client without keys: a limberd with "
           "CURVE "
           "keys looks like this, and so does what is no limberd";
  return "something listens there, but does not take these keys: a wrong server key, a client's "
         "key "
         "that is not in its --curve-allow file, or a limberd without keys look like this";
}

}  // namespace limber::client
