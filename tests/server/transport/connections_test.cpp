#include "server/transport/connections.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

using State = Connections::State;

TEST(Connections, AnEndNamesTheClient) {
  Connections connections;
  EXPECT_FALSE(connections.note_client({1, 20, ""}, "a"));
  EXPECT_FALSE(connections.note_client({2, 21, ""}, "b"));
  const auto ended = connections.end({20, 3});
  ASSERT_TRUE(ended.has_value());
  EXPECT_EQ(ended->client, "a");
  EXPECT_EQ(ended->number, 1u);
  EXPECT_FALSE(connections.end({20, 3}).has_value());
  EXPECT_FALSE(connections.end({99, 3}).has_value());  // it sent nothing
}

TEST(Connections, WhatComesAfterTheEndIsNotOfTheNextOnTheSameDescriptor) {
  Connections connections;
  (void)connections.end({20, 2});
  EXPECT_EQ(connections.note({1, 20, ""}), State::kEnded);
  EXPECT_EQ(connections.note({2, 20, ""}), State::kOpen);
  EXPECT_EQ(connections.note({1, 20, ""}), State::kEnded);
  EXPECT_FALSE(connections.note_client({2, 20, ""}, "b"));
  EXPECT_FALSE(connections.end({20, 2}).has_value());
  EXPECT_EQ(connections.end({20, 3})->client, "b");
}

TEST(Connections, AClientThatConnectsAgainUnderItsNameIsNotTheOneThatEnded) {
  Connections connections;
  EXPECT_FALSE(connections.note_client({1, 20, ""}, "a"));
  EXPECT_TRUE(connections.note_client({2, 21, ""}, "a"));
  EXPECT_FALSE(connections.note_client({2, 21, ""}, "a"));
  EXPECT_EQ(connections.end({20, 3})->client, "");
  EXPECT_EQ(connections.end({21, 3})->client, "a");
}

TEST(Connections, UserIds) {
  EXPECT_EQ(user_id_of(7, ""), "7");
  EXPECT_EQ(user_id_of(7, "key"), "7 key");
}

}  // namespace
}  // namespace limber::server
