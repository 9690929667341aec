#include "clients/cpp/socket_monitor.h"

#include <atomic>
#include <cstring>
#include <string>

namespace limber::client {

SocketMonitor::SocketMonitor(zmq::context_t& context, zmq::socket_t& watched, int kinds)
    : watched_(watched), events_(context, ZMQ_PAIR) {
  static std::atomic<unsigned> count{0};
  const std::string address = "inproc://limber-monitor-" + std::to_string(++count);
  if (zmq_socket_monitor(watched_.handle(), address.c_str(), kinds) != 0) throw zmq::error_t();
  events_.set(zmq::sockopt::linger, 0);
  events_.connect(address);
}

// Before events_ is closed: an event sent to a closed socket would block.
SocketMonitor::~SocketMonitor() { zmq_socket_monitor(watched_.handle(), nullptr, 0); }

std::uint16_t SocketMonitor::receive() {
  // An event is two frames: number and value, then the address.
  zmq::message_t frame, address;
  std::uint16_t event = 0;
  if (!events_.recv(frame, zmq::recv_flags::dontwait)) return event;
  if (frame.size() >= sizeof event) std::memcpy(&event, frame.data(), sizeof event);
  if (frame.more()) (void)events_.recv(address, zmq::recv_flags::dontwait);
  return event;
}

}  // namespace limber::client
