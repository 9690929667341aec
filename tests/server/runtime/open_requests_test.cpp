#include "server/runtime/open_requests.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

TEST(ServerOpenRequests, AreCountedInAllAndByClient) {
  OpenRequests open;
  open.begin("a");
  open.begin("a");
  open.begin("b");
  EXPECT_EQ(open.total(), 3u);
  EXPECT_EQ(open.of("a"), 2u);
  EXPECT_EQ(open.of("c"), 0u);
  open.answered("a");
  EXPECT_EQ(open.of("a"), 1u);  // it may send the next one
  EXPECT_EQ(open.total(), 3u);  // its reply is not sent yet
  open.end();
  EXPECT_EQ(open.total(), 2u);
  EXPECT_EQ(open.of("b"), 1u);
}

TEST(ServerOpenRequests, AnswersToNobodyLeaveThemAsTheyAre) {
  OpenRequests open;
  open.answered("a");
  EXPECT_EQ(open.of("a"), 0u);
  open.end();
  EXPECT_EQ(open.total(), 0u);
  open.begin("a");
  EXPECT_EQ(open.of("a"), 1u);
}

TEST(ServerOpenRequests, ThoseThatChangeSomethingAreOldOrNew) {
  OpenRequests open;
  const auto first = open.begin_lasting(), second = open.begin_lasting();
  EXPECT_EQ(open.lasting(), 2u);
  open.end_lasting(first);
  open.begin_epoch();
  const auto third = open.begin_lasting();
  EXPECT_EQ(open.old_lasting(), 1u);
  EXPECT_EQ(open.lasting(), 2u);
  open.end_lasting(second);
  EXPECT_EQ(open.old_lasting(), 0u);
  EXPECT_EQ(open.lasting(), 1u);
  open.end_lasting(third);
  EXPECT_EQ(open.lasting(), 0u);
}

}  // namespace
}  // namespace limber::server
