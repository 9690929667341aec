#pragma once

#include <cstdint>
#include <zmq.hpp>

namespace limber::client {

/// Events of a socket, sent to a socket of their own while this exists.
class SocketMonitor {
 public:
  /// @param kinds  of ZMQ_EVENT_..., or-ed. @throws zmq::error_t
  SocketMonitor(zmq::context_t& context, zmq::socket_t& watched, int kinds);
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;
  ~SocketMonitor();

  /// To wait on.
  [[nodiscard]] zmq::socket_t& events() { return events_; }
  /// The next event, 0 if there is none.
  [[nodiscard]] std::uint16_t receive();

 private:
  zmq::socket_t& watched_;
  zmq::socket_t events_;
};

}  // namespace limber::client
