// Problems with several minima: which one a session shows is no accident.

#include <gtest/gtest.h>

#include "engine/scene/samples/samples.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using spacetime::SolveStatus;
using test::held;
using test::Live;

/// The sample bird: its first answer is not the lowest there is, and an edit there and back finds
/// another.
constexpr int kPulledNode = 961, kPulledFrame = 60;
const Eigen::Vector3d kPull = {0, 0, 0.1};

double distance(const BodyResult& a, const BodyResult& b) {
  return (a.coordinates - b.coordinates).norm() / b.coordinates.norm();
}

TEST(SessionMinima, UndoAndRedoBringBackTheMotionThatWasThere) {
  Live live(scene::make_sample("bird"));
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  ASSERT_EQ(first->report.status, SolveStatus::kConverged);
  for (int i = 0; i < 3; ++i) {
    const auto added = live.edit({AddConstraint{held(kPulledFrame, kPulledNode, kPull)}});
    ASSERT_TRUE(added);
    EXPECT_GT(distance(*added, *first), 0.01);
    const auto undone = live.edit({Undo{}});
    ASSERT_TRUE(undone);
    EXPECT_EQ(undone->report.status, SolveStatus::kConverged);
    EXPECT_NEAR(undone->report.total_energy, first->report.total_energy,
                1e-9 * first->report.total_energy);
    EXPECT_LT(distance(*undone, *first), 1e-4);
    const auto redone = live.edit({Redo{}, Undo{}, Redo{}});
    ASSERT_TRUE(redone);
    EXPECT_LT(distance(*redone, *added), 1e-4);
    ASSERT_TRUE(live.edit({Undo{}}));
  }
}

TEST(SessionMinima, AColdSolveThatEndsHigherReplacesNothing) {
  Live live(scene::make_sample("bird"));
  const auto first = live.recorder->wait_final(0);
  ASSERT_TRUE(first);
  const auto added = live.edit({AddConstraint{held(kPulledFrame, kPulledNode, kPull)}});
  ASSERT_TRUE(added);
  // Not an undo: that would come back to the first answer.
  const auto revision =
      live.session.edit({RemoveConstraint{live.session.constraints().back().id}}).revision;
  const auto lower = live.recorder->wait_final(revision);
  ASSERT_TRUE(lower);
  ASSERT_LT(lower->report.total_energy, 0.9 * first->report.total_energy);
  live.session.solve_cold(3);
  const auto cold = live.recorder->wait_final(revision, lower->sequence);
  ASSERT_TRUE(cold);
  EXPECT_EQ(cold->cold_request, 3u);
  EXPECT_EQ(cold->report.total_energy, lower->report.total_energy);
  EXPECT_NE(cold->report.message.find("cold solve"), std::string::npos) << cold->report.message;
  EXPECT_LT(distance(*cold, *lower), 1e-12);
}

}  // namespace
}  // namespace limber::session
