#include "clients/cpp/reach.h"

#include <netdb.h>

#include <algorithm>
#include <cstdint>

#include "clients/cpp/socket_monitor.h"
#include "engine/base/checked_number.h"

namespace limber::client {
namespace {

/// A refused client is disconnected without a message at every attempt: it sees a connection
/// without a handshake. `HANDSHAKE_FAILED_...` is reported for some of the reasons only.
constexpr int kEvents = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_CONNECT_RETRIED |
                        ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                        ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                        ZMQ_EVENT_DISCONNECTED;

/// libzmq tries for ever to reach a host that has no address and a port beyond 65535.
bool is_place(const std::string& endpoint) {
  const std::string tcp = "tcp://";
  const auto colon = endpoint.rfind(':');
  if (!endpoint.starts_with(tcp) || colon < tcp.size()) return true;
  const auto port = parse_number<std::uint16_t>(std::string_view(endpoint).substr(colon + 1));
  if (!port || *port == 0) return false;
  std::string host = endpoint.substr(tcp.size(), colon - tcp.size());
  host.erase(0, host.rfind(';') + 1);  // behind the address to come from
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), nullptr, nullptr, &found);
  if (found != nullptr) freeaddrinfo(found);
  return failed == 0;
}

}  // namespace

Reach probe(Client& client, Milliseconds patience) {
  if (!is_place(client.endpoint())) return Reach::kNoSuchPlace;
  zmq::socket_t socket(client.context(), ZMQ_DEALER);
  client.configure(socket);
  SocketMonitor monitor(client.context(), socket, kEvents);
  socket.connect(client.endpoint());
  const auto deadline = std::chrono::steady_clock::now() + patience;
  Reach reach = Reach::kNobody;
  for (bool decided = false; !decided;) {
    const auto left = std::chrono::ceil<Milliseconds>(deadline - std::chrono::steady_clock::now());
    if (!client.wait_readable(monitor.events(), std::max(left, Milliseconds{0}))) break;
    const std::uint16_t event = monitor.receive();
    if (event == 0) continue;
    decided = event != ZMQ_EVENT_CONNECTED;
    if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED)
      reach = Reach::kHandshake;
    else if (event != ZMQ_EVENT_CONNECT_RETRIED)
      reach = Reach::kNoHandshake;
  }
  return reach;
}

std::string advice(Reach reach, const Client& client) {
  switch (reach) {
    case Reach::kNobody:
      return "nothing listens there";
    case Reach::kNoSuchPlace:
      return "the name of its host is not known, or its port is not within 1 to 65535";
    case Reach::kHandshake:
      return "something lets this client in, but is busy or hangs";
    case Reach::kNoHandshake:
      break;
  }
  if (!client.options().keys)
    return "something listens there, but does not let in a client without keys: a limberd with "
           "CURVE keys looks like this, and so does what is no limberd";
  return "something listens there, but does not take these keys: a wrong server key, a client's "
         "key that is not in its --curve-allow file, or a limberd without keys look like this";
}

}  // namespace limber::client
