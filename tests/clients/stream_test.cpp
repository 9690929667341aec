#include "clients/cpp/stream.h"

#include <gtest/gtest.h>

#include "tests/clients/fake_router.h"

namespace limber::client {
namespace {

std::string stream_message(std::uint64_t sequence) {
  v1::StreamMessage message;
  message.set_version(1);
  message.set_sequence(sequence);
  return message.SerializeAsString();
}

std::vector<std::string> silent(const v1::Request&) { return {}; }

void await_subscriptions(const FakeRouter& router, int count) {
  for (int i = 0; i < 500 && router.subscriptions() < count; ++i)
    std::this_thread::sleep_for(Milliseconds{10});
  ASSERT_GE(router.subscriptions(), count);
}

TEST(Subscription, CountsGapsPerTopic) {
  FakeRouter router(silent);
  Client client(router.requests());
  Subscription stream(client, router.stream());
  stream.subscribe("a");
  stream.subscribe("b");
  await_subscriptions(router, 2);
  router.publish("a", stream_message(5));
  router.publish("b", stream_message(9));
  router.publish("a", stream_message(6));
  router.publish("a", "\xff\xff garbage");
  router.publish("a", stream_message(10));
  router.publish("b", stream_message(10));
  std::vector<std::uint64_t> missed;
  for (int i = 0; i < 5; ++i) {
    const auto event = stream.next(Milliseconds{5000});
    ASSERT_TRUE(event.has_value());
    missed.push_back(event->missed);
  }
  EXPECT_EQ(missed, (std::vector<std::uint64_t>{0, 0, 0, 3, 0}));
  EXPECT_EQ(stream.missed(), 3U);
  EXPECT_FALSE(stream.next(Milliseconds{20}).has_value());
}

TEST(Subscription, WhoPausesFindsTheNewest) {
  FakeRouter router(silent);
  Client client(router.requests());
  Subscription stream(client, router.stream());
  stream.subscribe("a");
  await_subscriptions(router, 1);
  for (std::uint64_t i = 1; i <= 100; ++i) router.publish("a", stream_message(i));
  std::this_thread::sleep_for(Milliseconds{500});
  std::vector<std::uint64_t> read;
  while (const auto event = stream.next(Milliseconds{20}))
    read.push_back(event->message.sequence());
  EXPECT_EQ(read, (std::vector<std::uint64_t>{93, 94, 95, 96, 97, 98, 99, 100}));
  EXPECT_EQ(stream.missed(), 92U);
}

TEST(Subscription, WhatIsUnsubscribedComesNoMore) {
  FakeRouter router(silent);
  Client client(router.requests());
  Subscription stream(client, router.stream());
  stream.subscribe("a");
  stream.subscribe("b");
  stream.unsubscribe("a");
  await_subscriptions(router, 3);
  router.publish("a", stream_message(1));
  router.publish("b", stream_message(2));
  const auto event = stream.next(Milliseconds{5000});
  ASSERT_TRUE(event.has_value());
  EXPECT_EQ(event->topic, "b");
}

/// Of whom a client has heard: a restarted server publishes under the same names.
TEST(Subscription, AMessageOfAnotherRunIsReportedAsARestart) {
  const auto of_run = [](std::uint64_t sequence, const std::string& instance,
                         std::uint64_t uid = 0) {
    v1::StreamMessage message;
    message.set_version(1);
    message.set_sequence(sequence);
    message.set_instance(instance);
    message.set_session_uid(uid);
    return message.SerializeAsString();
  };
  FakeRouter router([](const v1::Request& request) -> std::vector<std::string> {
    v1::Reply reply;
    reply.set_version(1);
    reply.set_id(request.id());
    reply.set_instance("first");
    reply.mutable_get_server_info()->set_instance("first");
    return {reply.SerializeAsString()};
  });
  Client client(router.requests());
  (void)client.call(v1::GetServerInfoRequest{});
  ASSERT_EQ(client.instance(), "first");
  Subscription stream(client, router.stream());
  stream.subscribe("a");
  await_subscriptions(router, 1);
  router.publish("a", of_run(1, "first", 5));
  router.publish("a", of_run(1, "second", 5));
  router.publish("a", of_run(1, "second", 6));
  const auto event = stream.next(Milliseconds{5000});
  ASSERT_TRUE(event.has_value());
  EXPECT_EQ(event->message.instance(), "first");
  const auto stored = stream.next(Milliseconds{5000});
  ASSERT_TRUE(stored.has_value()) << "a session that is stored goes on";
  EXPECT_EQ(stored->message.instance(), "second");
  try {
    (void)stream.next(Milliseconds{5000});
    FAIL() << "it is none of this run";
  } catch (const ServerRestarted& restarted) {
    EXPECT_EQ(restarted.code(), v1::ERROR_CODE_RESTARTED);
  }
}

TEST(Subscription, AnInterruptionEndsTheWait) {
  FakeRouter router(silent);
  ClientOptions options;
  bool interrupted = false;
  options.interrupted = [&] { return interrupted; };
  Client client(router.requests(), options);
  Subscription stream(client, router.stream());
  interrupted = true;
  EXPECT_THROW((void)stream.next(Milliseconds{60000}), ClientError);
}

TEST(Subscription, NoStreamIsUnreachable) {
  FakeRouter router(silent);
  ClientOptions options;
  options.timeout = Milliseconds{100};
  Client client(router.requests(), options);
  EXPECT_THROW(Subscription(client, "ipc:///nonexistent/limber-stream"), Unreachable);
}

TEST(Subscription, TopicsAndWildcardHosts) {
  EXPECT_EQ(frames_topic("s", v1::ENCODING_UNSPECIFIED), "session/s/body/0/coordinates");
  EXPECT_EQ(frames_topic("s", v1::ENCODING_POSITIONS_QUANTISED), "session/s/body/0/quantised");
  EXPECT_EQ(status_topic("s"), "session/s/status");
  EXPECT_EQ(reachable("tcp://0.0.0.0:7802", "tcp://lab.example:7801"), "tcp://lab.example:7802");
  EXPECT_EQ(reachable("tcp://127.0.0.1:7802", "tcp://lab.example:7801"), "tcp://127.0.0.1:7802");
  EXPECT_EQ(reachable("ipc:///a", "tcp://lab.example:7801"), "ipc:///a");
}

}  // namespace
}  // namespace limber::client
