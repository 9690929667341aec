#include <gtest/gtest.h>

#include <memory>

#include "engine/session/bodies/session.h"
#include "tests/engine/session/bodies/session_support.h"
#include "tests/engine/session/contract/manual_executor.h"

// A round is solved in two parts where an executor tells urgent tasks from others: a first answer,
// and what is left of it.

namespace limber::session::test {
namespace {

using contract::ManualExecutor;

class SessionRest : public ::testing::Test {
 protected:
  SessionRest() { settle(); }

  static BodyEdit moved_to(double y) { return MoveConstraint{1, {0, y, 0.05}}; }
  void settle() {
    while (prompt.run_one() || refining.run_one() || patient.run_one()) {
    }
  }
  [[nodiscard]] std::shared_ptr<const BodyResult> newest() const {
    return session->newest_result();
  }

  ManualExecutor prompt, refining, patient;
  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>();
  std::unique_ptr<BodySession> session =
      std::make_unique<BodySession>("rest", bent_bar(), SessionOptions{}, shared_cache(),
                                    prompt.executor(refining, patient), recorder);
};

TEST_F(SessionRest, FollowsAFirstAnswerAsATaskThatGivesWay) {
  session->edit({moved_to(0.12)});
  prompt.run_one();
  EXPECT_EQ(newest()->revision, 1U);
  EXPECT_FALSE(newest()->is_final);
  EXPECT_EQ(prompt.waiting(), 0U);
  ASSERT_EQ(refining.waiting(), 1U);
  refining.run_one();
  EXPECT_EQ(newest()->revision, 1U);
  EXPECT_TRUE(newest()->is_final);
  EXPECT_EQ(newest()->report.status, spacetime::SolveStatus::kConverged);
}

TEST_F(SessionRest, IsLetGoByAnEdit) {
  session->edit({moved_to(0.12)});
  prompt.run_one();
  const auto final_before = session->final_result();
  session->edit({moved_to(0.13)});
  ASSERT_EQ(prompt.waiting(), 1U) << "it does not wait behind what is refined";
  prompt.run_one();
  EXPECT_EQ(newest()->revision, 2U);
  EXPECT_EQ(session->final_result(), final_before);
  EXPECT_EQ(refining.waiting(), 2U) << "of the first edit, which does nothing any more, too";
  refining.run_one();
  EXPECT_EQ(session->final_result(), final_before);
  refining.run_one();
  EXPECT_TRUE(newest()->is_final);
  EXPECT_EQ(newest()->revision, 2U);
}

TEST_F(SessionRest, EndsPromptlyWhereItIsCancelled) {
  session->edit({moved_to(0.12)});
  prompt.run_one();
  session->cancel();
  ASSERT_EQ(prompt.waiting(), 1U);
  prompt.run_one();
  EXPECT_TRUE(newest()->is_final);
  EXPECT_EQ(newest()->revision, 1U);
  EXPECT_EQ(newest()->report.status, spacetime::SolveStatus::kCancelled);
  settle();
  EXPECT_EQ(newest()->report.status, spacetime::SolveStatus::kCancelled);
}

TEST_F(SessionRest, IsGivenUpByASessionThatCloses) {
  session->edit({moved_to(0.12)});
  prompt.run_one();
  ASSERT_EQ(refining.waiting(), 1U);
  const auto sequence = newest()->sequence;
  session->close();
  settle();
  EXPECT_EQ(newest()->sequence, sequence);
  session.reset();
  EXPECT_EQ(recorder->fault(), "");
}

TEST_F(SessionRest, LeadsToTheAnswerOfOneTask) {
  session->edit({moved_to(0.12)});
  settle();
  ManualExecutor one;
  BodySession whole("whole", bent_bar(), {}, shared_cache(), one.executor(), nullptr);
  one.run_all();
  whole.edit({moved_to(0.12)});
  one.run_all();
  ASSERT_TRUE(whole.newest_result()->is_final);
  EXPECT_EQ(whole.newest_result()->modal, newest()->modal);
  EXPECT_EQ(whole.newest_result()->coordinates, newest()->coordinates);
}

}  // namespace
}  // namespace limber::session::test
