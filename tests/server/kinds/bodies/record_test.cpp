#include "server/kinds/bodies/record.h"

#include <gtest/gtest.h>

#include "tests/server/support/running_server.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

struct ServerBodyRecord : ::testing::Test {
  Hub hub{test_options()};
  const JobId opening = hub.jobs.start("open_session", "s", {});
  std::shared_ptr<BodyRecord> record = std::make_shared<BodyRecord>(
      hub, SessionKey{"s", 1}, BodyRecord::Opened{"s", "s", {}, 4, 1, 10}, opening);

  void publish(std::uint64_t sequence, JobId cold_request) {
    auto result = std::make_shared<session::BodyResult>();
    result->sequence = sequence;
    result->is_final = true;
    result->cold_request = cold_request;
    record->on_result(result);
  }
  proto::JobState state(JobId job) { return hub.jobs.status(job).state(); }
};

TEST_F(ServerBodyRecord, AWarmResultThatBecomesFinalJustThenDoesNotEndAColdJob) {
  publish(1, 0);
  EXPECT_EQ(state(opening), proto::JOB_STATE_DONE);
  const JobId first = hub.jobs.start("solve_cold", "s", {});
  record->expect_cold(first);
  publish(2, 0);
  EXPECT_EQ(state(first), proto::JOB_STATE_RUNNING);
  const JobId second = hub.jobs.start("solve_cold", "s", {});
  record->expect_cold(second);
  EXPECT_EQ(state(first), proto::JOB_STATE_CANCELLED) << "started over";
  publish(3, first);
  EXPECT_EQ(state(second), proto::JOB_STATE_RUNNING);
  publish(4, second);
  EXPECT_EQ(state(second), proto::JOB_STATE_DONE);
}

}  // namespace
}  // namespace limber::server
