#include "server/runtime/attendance.h"

#include <gtest/gtest.h>

namespace limber::server {
namespace {

using Clock = Attendance::Clock;
using std::chrono::seconds;

struct AttendanceTest : ::testing::Test {
  const Clock::time_point begin = Clock::now();
  Attendance attendance{begin};

  proto::SessionStatus status(seconds after) const {
    proto::SessionStatus status;
    attendance.describe(status, begin + after);
    return status;
  }
};

TEST_F(AttendanceTest, ListsWhoIsThereTheLongestFirst) {
  EXPECT_EQ(attendance.join({7, "ana"}, begin + seconds(1)), Attendance::Joined::kNew);
  EXPECT_EQ(attendance.join({4, "ben"}, begin + seconds(2)), Attendance::Joined::kNew);
  EXPECT_EQ(attendance.join({7, "anna"}, begin + seconds(3)), Attendance::Joined::kAgain);
  const auto told = status(seconds(5));
  ASSERT_EQ(told.clients_size(), 2);
  EXPECT_EQ(told.clients(0).name(), "anna");
  EXPECT_DOUBLE_EQ(told.clients(0).present_s(), 4);
  EXPECT_EQ(told.clients(1).client(), 4u);
  EXPECT_DOUBLE_EQ(told.age_s(), 5);
  EXPECT_TRUE(attendance.leave(7));
  EXPECT_FALSE(attendance.leave(7));
  EXPECT_EQ(status(seconds(5)).clients_size(), 1);
}

TEST_F(AttendanceTest, IsFullWithSoMany) {
  for (std::uint64_t number = 1; number <= Attendance::kMaxClients; ++number)
    EXPECT_EQ(attendance.join({number, "one"}, begin), Attendance::Joined::kNew);
  EXPECT_EQ(attendance.join({999, "late"}, begin), Attendance::Joined::kFull);
  EXPECT_EQ(attendance.join({1, "one"}, begin), Attendance::Joined::kAgain);
}

TEST_F(AttendanceTest, JoinsRevisionsOfOneClientAndKind) {
  attendance.join({1, "ana"}, begin);
  attendance.note_revision({1, "ana"}, 1, {"move"}, begin + seconds(1));
  attendance.note_revision({1, "ana"}, 2, {"move"}, begin + seconds(2));
  attendance.note_revision({2, "ben"}, 3, {"move"}, begin + seconds(3));
  attendance.note_revision({1, "ana"}, 4, {"move"}, begin + seconds(4));
  attendance.note_revision({1, "ana"}, 5, {"undo"}, begin + seconds(5));
  const auto told = status(seconds(10));
  ASSERT_EQ(told.revisions_size(), 4);
  EXPECT_EQ(told.revisions(0).edits(0), "undo");
  EXPECT_EQ(told.revisions(3).first(), 1u);
  EXPECT_EQ(told.revisions(3).revision(), 2u);
  EXPECT_DOUBLE_EQ(told.revisions(3).age_s(), 8);
  EXPECT_EQ(told.revisions(2).name(), "ben");
  EXPECT_EQ(told.clients(0).last_revision(), 5u);
}

TEST_F(AttendanceTest, OrdersRevisionsThatAreNotedLate) {
  attendance.note_revision({1, "ana"}, 3, {"add"}, begin);
  attendance.note_revision({2, "ben"}, 2, {"add"}, begin);
  const auto told = status(seconds(0));
  ASSERT_EQ(told.revisions_size(), 2);
  EXPECT_EQ(told.revisions(0).revision(), 3u);
  EXPECT_EQ(told.revisions(1).revision(), 2u);
}

TEST_F(AttendanceTest, KeepsTheNewestRevisions) {
  for (std::uint64_t revision = 1; revision <= 2 * Attendance::kMaxRevisions; ++revision)
    attendance.note_revision({revision % 2, "one"}, revision, {"add"}, begin);
  const auto told = status(seconds(0));
  EXPECT_EQ(told.revisions_size(), static_cast<int>(Attendance::kMaxRevisions));
  EXPECT_EQ(told.revisions(0).revision(), 2 * Attendance::kMaxRevisions);
}

TEST_F(AttendanceTest, WhoComesBackHasWhatItMade) {
  attendance.join({1, "ana"}, begin);
  attendance.note_revision({1, "ana"}, 6, {"add"}, begin);
  attendance.leave(1);
  attendance.join({1, "ana"}, begin);
  EXPECT_EQ(status(seconds(0)).clients(0).last_revision(), 6u);
}

}  // namespace
}  // namespace limber::server
