#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>
#include <zmq.hpp>
#include <zmq_addon.hpp>

#include "limber/v1/service.pb.h"
#include "limber/v1/stream.pb.h"

namespace limber::server::testing {

namespace proto = limber::v1;
using std::chrono::milliseconds;

/// A DEALER client that sends bare payloads.
class Client {
 public:
  explicit Client(const std::string& endpoint, int queue = 1000) : socket_(context_, ZMQ_DEALER) {
    socket_.set(zmq::sockopt::rcvhwm, queue);
    socket_.set(zmq::sockopt::linger, 0);
    socket_.connect(endpoint);
  }
  /// @returns the id the reply will carry
  std::uint64_t send(proto::Request request) {
    request.set_version(1);
    request.set_id(++last_);
    send_bytes(request.SerializeAsString());
    return last_;
  }
  void send_bytes(const std::string& bytes) { socket_.send(zmq::buffer(bytes)); }
  std::optional<proto::Reply> receive(milliseconds timeout = milliseconds(30000)) {
    socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(timeout.count()));
    zmq::message_t message;
    do {
      if (!socket_.recv(message)) return std::nullopt;
    } while (message.more());  // a delimiter, where one was sent
    proto::Reply reply;
    if (!reply.ParseFromArray(message.data(), static_cast<int>(message.size()))) {
      ADD_FAILURE() << "the reply cannot be parsed";
    }
    return reply;
  }
  /// Sends and waits for the reply of that id; others in between are a failure.
  proto::Reply call(const proto::Request& request) {
    const std::uint64_t id = send(request);
    auto reply = receive();
    if (!reply) {
      ADD_FAILURE() << "no reply to " << request.ShortDebugString().substr(0, 200);
      return {};
    }
    EXPECT_EQ(reply->id(), id);
    EXPECT_EQ(reply->version(), 1u);
    return *reply;
  }
  zmq::socket_t& socket() { return socket_; }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::uint64_t last_ = 0;
};

/// A SUB socket.
class Subscriber {
 public:
  explicit Subscriber(const std::string& endpoint, int queue = 1000) : socket_(context_, ZMQ_SUB) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::rcvhwm, queue);
    socket_.connect(endpoint);
  }
  void subscribe(const std::string& prefix) { socket_.set(zmq::sockopt::subscribe, prefix); }
  struct Message {
    std::string topic;
    proto::StreamMessage content;
    std::size_t bytes = 0;
  };
  std::optional<Message> receive(milliseconds timeout = milliseconds(10000)) {
    socket_.set(zmq::sockopt::rcvtimeo, static_cast<int>(timeout.count()));
    zmq::message_t topic, content;
    if (!socket_.recv(topic)) return std::nullopt;
    EXPECT_TRUE(topic.more());
    if (!socket_.recv(content)) return std::nullopt;
    Message message{topic.to_string(), {}, content.size()};
    EXPECT_TRUE(message.content.ParseFromArray(content.data(), static_cast<int>(content.size())));
    return message;
  }
  zmq::socket_t& socket() { return socket_; }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_;
};

inline proto::Request open_request(const proto::Scene& scene, const std::string& session = "") {
  proto::Request request;
  *request.mutable_open_session()->mutable_scene() = scene;
  request.mutable_open_session()->set_session(session);
  return request;
}

inline proto::Request wait_request(
    const std::string& session, std::uint64_t revision, double timeout_s = 60,
    proto::WaitRequest::Until until = proto::WaitRequest::UNTIL_FINAL) {
  proto::Request request;
  request.mutable_wait()->set_session(session);
  request.mutable_wait()->set_revision(revision);
  request.mutable_wait()->set_timeout_s(timeout_s);
  request.mutable_wait()->set_until(until);
  return request;
}

inline proto::Request move_request(const std::string& session, std::uint64_t id, double x, double y,
                                   double z) {
  proto::Request request;
  request.mutable_edit()->set_session(session);
  auto* move = request.mutable_edit()->add_edits()->mutable_move();
  move->set_id(id);
  move->mutable_target()->set_x(x);
  move->mutable_target()->set_y(y);
  move->mutable_target()->set_z(z);
  return request;
}

inline proto::Request job_request(std::uint64_t job, double wait_s) {
  proto::Request request;
  request.mutable_get_job()->set_job(job);
  request.mutable_get_job()->set_wait_s(wait_s);
  return request;
}

inline proto::Request info_request() {
  proto::Request request;
  request.mutable_get_server_info();
  return request;
}

}  // namespace limber::server::testing
