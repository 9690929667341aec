// Frames that a client gets while a session changes its modes: each against the one before.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "tests/engine/session/bodies/mode_scenes.h"

namespace limber::session {
namespace {

using test::choosing;
using test::easy_bar;
using test::Live;
using test::pull_apart;
using test::pulled_apart;
using test::settled;

constexpr int kFrames = 30, kSteps = 30;
constexpr int kPause = 8;  // steps from one pause to the next: there the modes may change
constexpr double kPulled = 0.3, kTolerance = 0.015;
// The edit itself, in a session that keeps its modes: a step with other modes is as large but for
// what these change.
constexpr double kOfEdit = 1.3;

/// The farthest that a node is from where it is in another motion, in any frame [m].
double farthest(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  double most = 0;
  for (Eigen::Index node = 0; node < a.rows() / 3; ++node)
    most = std::max(most, (a - b).middleRows(3 * node, 3).colwise().norm().maxCoeff());
  return most;
}

/// A result against the one before it.
struct Step {
  Revision revision = 0;
  int mode_changes = 0;
  double jump = 0;  // farthest()
  double size = 0;  // farthest() of the motion from its first frame, where the body is at rest
};

/// All that a client gets of a drag that pulls two nodes apart, with pauses.
std::vector<Step> steps_of_drag(const scene::Scene& scene) {
  Live live(scene, choosing());
  if (!settled(live.session)) return {};
  const EditReceipt held = live.session.edit(pull_apart(0));
  if (!live.recorder->wait_final(held.revision)) return {};
  const auto& ids = held.constraint_ids;
  for (int step = 1; step <= kSteps; ++step) {
    const auto targets = pulled_apart(kPulled * step / kSteps);
    const Revision revision = live.session
                                  .edit({MoveConstraint{ids.at(0), targets[0].target},
                                         MoveConstraint{ids.at(1), targets[1].target}})
                                  .revision;
    const bool is_pause = step % kPause == 0;
    if (!(is_pause ? settled(live.session, revision) : live.recorder->wait_final(revision)))
      return {};
  }
  EXPECT_EQ(live.recorder->fault(), "");
  std::vector<Step> steps;
  Eigen::MatrixXd before;
  for (const auto& result : live.recorder->results()) {
    EXPECT_FALSE(result->solve_failed) << result->report.message;
    Eigen::MatrixXd now = live.session.positions(*result, 0, kFrames);
    const double jump = before.size() > 0 ? farthest(now, before) : 0;
    steps.push_back({result->revision, result->mode_changes, jump,
                     farthest(now, now.col(0).replicate(1, kFrames))});
    before = std::move(now);
  }
  return steps;
}

/// The largest jump of each revision. Which results on the way a session publishes depends on the
/// time they take: of several drags.
std::map<Revision, double> jumps_of_edits(const scene::Scene& scene) {
  constexpr int kDrags = 4;
  std::map<Revision, double> largest;
  for (int drag = 0; drag < kDrags; ++drag) {
    for (const Step& step : steps_of_drag(scene))
      largest[step.revision] = std::max(largest[step.revision], step.jump);
  }
  return largest;
}

TEST(SessionModeSwaps, NoFrameOfADragJumpsBeyondItsEdit) {
  scene::Scene named = easy_bar();
  named.model.modes_by = scene::ModelRequest::ModesBy::kScene;
  const auto of_edits = jumps_of_edits(named);
  const std::vector<Step> steps = steps_of_drag(easy_bar());
  ASSERT_FALSE(of_edits.empty() || steps.empty());
  ASSERT_EQ(steps.back().mode_changes, 1) << "the drag is to pass a change of modes";
  Revision edited = steps.front().revision, swapped = 0;
  int modes = 0;
  for (std::size_t i = 1; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const double tolerance = kTolerance * step.size;
    if (step.mode_changes != modes) {  // no edit came, only more modes
      EXPECT_EQ(step.revision, edited);
      EXPECT_GT(step.jump, 0);
      EXPECT_LE(step.jump, tolerance) << "revision " << step.revision;
      swapped = step.revision;
    } else {
      EXPECT_LE(step.jump, kOfEdit * of_edits.at(step.revision) + tolerance)
          << "revision " << step.revision << " after " << modes << " changes";
    }
    edited = step.revision;
    modes = step.mode_changes;
  }
  // Amid the drag: edits came before it and after.
  EXPECT_GT(swapped, steps.front().revision + 2);
  EXPECT_GT(edited, swapped);
}

}  // namespace
}  // namespace limber::session
