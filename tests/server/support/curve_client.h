#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "server/transport/curve.h"
#include "tests/server/support/running_server.h"

namespace limber::server::testing {

inline void use_keys(zmq::socket_t& socket, const CurveKeys& own, const std::string& server) {
  socket.set(zmq::sockopt::curve_serverkey, server);
  socket.set(zmq::sockopt::curve_publickey, own.public_key);
  socket.set(zmq::sockopt::curve_secretkey, own.secret_key);
}

/// A DEALER with CURVE keys.
class CurveClient {
 public:
  CurveClient(const std::string& endpoint, const CurveKeys& own, const std::string& server)
      : socket_(context_, ZMQ_DEALER) {
    socket_.set(zmq::sockopt::linger, 0);
    use_keys(socket_, own, server);
    socket_.connect(endpoint);
  }
  /// Nothing: no answer within the time.
  std::optional<proto::Reply> ask(proto::Request request,
                                  milliseconds timeout = milliseconds(30000)) {
    request.set_version(1);
    request.set_id(++last_);
    socket_.send(zmq::buffer(request.SerializeAsString()), zmq::send_flags::dontwait);
    socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(timeout.count()));
    zmq::message_t message;
    proto::Reply reply;
    do {
      if (!socket_.recv(message)) return std::nullopt;
      EXPECT_TRUE(reply.ParseFromArray(message.data(), static_cast<int>(message.size())));
    } while (reply.id() != last_);
    return reply;
  }
  proto::Reply call(const proto::Request& request) {
    const auto reply = ask(request);
    if (!reply) ADD_FAILURE() << "no reply to " << request.ShortDebugString().substr(0, 200);
    return reply.value_or(proto::Reply());
  }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::uint64_t last_ = 0;
};

}  // namespace limber::server::testing
