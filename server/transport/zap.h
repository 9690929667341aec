#pragma once

#include <set>
#include <string>
#include <thread>
#include <zmq.hpp>

#include "server/transport/counters.h"

namespace limber::server {

/// Decides which CURVE clients may connect (RFC 27, ZAP): a thread at inproc://zeromq.zap.01 of one
/// context. Must live before the sockets it guards are bound: without a handler libzmq lets
/// everybody in.
class ZapHandler {
 public:
  /// @param allowed  public keys, Z85; everybody else is answered 400
  ZapHandler(zmq::context_t& context, std::set<std::string> allowed, Counters& counters);
  ~ZapHandler();
  ZapHandler(const ZapHandler&) = delete;
  ZapHandler& operator=(const ZapHandler&) = delete;

 private:
  void answer(zmq::socket_t& socket);

  zmq::socket_t stop_;  // inproc PAIR: a message ends the thread
  std::set<std::string> allowed_;
  Counters& counters_;
  std::thread thread_;
};

}  // namespace limber::server
