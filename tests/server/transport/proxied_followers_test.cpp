// Followers behind a proxy: all that comes by one connection, told apart by the frames before it.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "limber/v1/follow.pb.h"
#include "server/transport/followers.h"
#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

constexpr const char* kTopic = "session/s/body/0/coordinates";

struct ProxiedFollowers : ::testing::Test {
  void SetUp() override {
    open_and_solve(client, "s");
    proxy.set(zmq::sockopt::linger, 0);
    proxy.connect(server->request_endpoint());
  }

  /// As a DEALER of a proxy passes on what `name` sends.
  void follow(const std::string& name) {
    proto::Request request;
    request.set_version(1);
    request.set_id(++last);
    request.mutable_follow()->set_stream("stream of " + name);
    request.mutable_follow()->add_topics()->set_prefix(kTopic);
    proxy.send(zmq::buffer(name), zmq::send_flags::sndmore);
    proxy.send(zmq::message_t(), zmq::send_flags::sndmore);
    proxy.send(zmq::buffer(request.SerializeAsString()));
  }

  struct Received {
    std::map<std::string, proto::FollowResponse> answers;
    std::map<std::string, std::uint64_t> revisions;  // of the newest frames
  };
  /// What comes until each of the two has an answer, where they asked, and frames of a revision.
  Received receive(std::uint64_t revision, std::size_t answers) {
    Received received;
    const auto is_whole = [&] {
      return received.answers.size() >= answers && received.revisions.size() == 2 &&
             received.revisions.begin()->second >= revision &&
             received.revisions.rbegin()->second >= revision;
    };
    while (!is_whole()) {
      std::vector<zmq::message_t> frames;
      proxy.set(zmq::sockopt::rcvtimeo, 20'000);
      if (!zmq::recv_multipart(proxy, std::back_inserter(frames))) {
        ADD_FAILURE() << "nothing comes";
        break;
      }
      const std::string name = frames.at(0).to_string();
      EXPECT_EQ(frames.at(1).size(), 0u);
      if (frames.size() == 3) {
        proto::Reply reply;
        EXPECT_TRUE(reply.ParseFromString(frames[2].to_string()));
        received.answers[name] = reply.follow();
        continue;
      }
      EXPECT_EQ(frames.size(), 5u);
      EXPECT_EQ(frames[2].to_string(), kTopic);
      proto::StreamMessage message;
      EXPECT_TRUE(message.ParseFromString(frames[3].to_string()));
      received.revisions[name] = message.frames().result().revision();
    }
    return received;
  }

  RunningServer server;
  Client client{server->request_endpoint()};
  zmq::context_t context;
  zmq::socket_t proxy{context, ZMQ_DEALER};
  std::uint64_t last = 0;
};

TEST_F(ProxiedFollowers, AreToldWhatThereAreTooManyOf) {
  for (std::size_t i = 0; i <= Followers::kMostOfConnection; ++i) follow(std::to_string(i));
  proxy.set(zmq::sockopt::rcvtimeo, 20'000);
  const std::string last_one = std::to_string(Followers::kMostOfConnection);
  std::vector<zmq::message_t> frames;
  while (frames.size() != 3 || frames[0].to_string() != last_one) {
    frames.clear();
    ASSERT_TRUE(zmq::recv_multipart(proxy, std::back_inserter(frames))) << "nothing comes";
  }
  proto::Reply reply;
  ASSERT_TRUE(reply.ParseFromString(frames[2].to_string()));
  ASSERT_TRUE(reply.has_error());
  EXPECT_EQ(reply.error().code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(reply.error().field(), "stream");
  EXPECT_EQ(reply.error().details().at("limit"), last_one);
}

TEST_F(ProxiedFollowers, HaveAStreamEach) {
  follow("one");
  follow("two");
  const auto begun = receive(0, 2);
  for (const auto& [name, answer] : begun.answers) {
    EXPECT_FALSE(answer.continued()) << name;
    EXPECT_EQ(answer.cut_off(), "") << name;
  }
  ASSERT_TRUE(client.call(move_request("s", 1, 0, 0.02, 0)).has_edit());
  receive(1, 0);
  follow("one");
  follow("two");
  ASSERT_TRUE(client.call(move_request("s", 1, 0, 0.03, 0)).has_edit());
  for (const auto& [name, answer] : receive(2, 2).answers) {
    EXPECT_TRUE(answer.continued()) << name;
    EXPECT_EQ(answer.cut_off(), "") << name << " was displaced";
  }
}

}  // namespace
}  // namespace limber::server
