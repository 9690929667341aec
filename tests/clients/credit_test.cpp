#include "clients/cpp/credit.h"

#include <gtest/gtest.h>

#include <memory>

namespace limber::client {
namespace {

v1::FollowRequest request_of(Credit& credit) {
  v1::Request request;
  EXPECT_TRUE(request.ParseFromString(credit.request()));
  EXPECT_EQ(request.version(), 1u);
  EXPECT_EQ(request.id(), credit.id());
  EXPECT_EQ(request.client_name(), "me");
  return request.follow();
}

bool note(Credit& credit, const std::string& topic, std::uint64_t sequence,
          std::uint64_t position) {
  v1::StreamMessage message;
  message.set_sequence(sequence);
  message.set_instance("run");
  v1::StreamPosition at;
  at.set_sent_bytes(position);
  return credit.note(topic, message, at);
}

TEST(Credit, SaysAllInEveryRequest) {
  Credit credit("me");
  credit.want("a");
  credit.want("b");
  const auto first = request_of(credit);
  EXPECT_EQ(first.stream().size(), 32u);
  ASSERT_EQ(first.topics_size(), 2);
  EXPECT_EQ(first.topics(0).prefix(), "a");
  EXPECT_EQ(first.topics(0).after(), 0u);
  EXPECT_FALSE(note(credit, "a", 7, 1000));
  EXPECT_FALSE(note(credit, "of a prefix", 9, 2000));
  credit.leave("b");
  const auto second = request_of(credit);
  EXPECT_EQ(second.stream(), first.stream());
  ASSERT_EQ(second.topics_size(), 1);
  EXPECT_EQ(second.topics(0).after(), 7u);
  EXPECT_EQ(second.read_bytes(), 2000u);
  EXPECT_EQ(second.instance(), "run");
  EXPECT_NE(request_of(*std::make_unique<Credit>("me")).stream(), first.stream());
}

TEST(Credit, IsGivenAgainWhenAQuarterOfTheWindowIsRead) {
  Credit credit("me");
  v1::FollowResponse answer;
  answer.set_window_bytes(4000);
  credit.note(answer);
  EXPECT_FALSE(note(credit, "a", 1, 999));
  EXPECT_TRUE(note(credit, "a", 2, 1000));
  (void)credit.request();
  EXPECT_FALSE(note(credit, "a", 3, 1999));
  EXPECT_TRUE(note(credit, "a", 4, 90'000));
  (void)credit.request();
  EXPECT_TRUE(note(credit, "a", 1, 10)) << "the server was restarted";
}

TEST(Credit, KeepsWhyTheStreamHadEnded) {
  Credit credit("me");
  v1::FollowResponse answer;
  credit.note(answer);
  EXPECT_EQ(credit.cut_off(), "");
  answer.set_cut_off("slow");
  credit.note(answer);
  credit.note(v1::FollowResponse());
  EXPECT_EQ(credit.cut_off(), "slow");
}

}  // namespace
}  // namespace limber::client
