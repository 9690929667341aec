// Editing by linear modal offsets and warping the answer (Barbic, Sin and Grinspun 2012), with
// which space-time editing compares itself in figure 5: what was met before the warp is missed
// after it.

#include <gtest/gtest.h>

#include "engine/bodies/modal_analysis.h"
#include "engine/session/bodies/problem_mapping.h"
#include "engine/spacetime/solver.h"
#include "tests/engine/reduced/sample_bodies.h"
#include "tests/support/published.h"
#include "tests/support/reconstruction.h"

namespace limber::session {
namespace {

using reduced::Reconstruction;

struct EditedMotion {
  Eigen::MatrixXd motion;
  spacetime::SolveReport report;
};

constexpr int kEditedFrame = 30;

EditedMotion edit(const std::shared_ptr<Reconstruction>& editor, const reduced::ScaledModes& modes,
                  int node, const Eigen::Vector3d& target) {
  spacetime::Timeline timeline;
  timeline.frame_count = 60;
  spacetime::Solver solver(editor,
                           map_dynamics(testing::published_dynamics(), modes.eigenvalues,
                                        modes.rigid_count, modes.mechanism_count),
                           timeline);
  spacetime::PositionConstraint constraint;
  constraint.id = 1;
  constraint.frame = kEditedFrame;
  constraint.site = editor->add_site({node});
  constraint.target = target;
  constraint.weight = 1e6;
  solver.add(constraint);
  EditedMotion edited;
  edited.report = solver.solve();
  edited.motion = solver.motion();
  return edited;
}

TEST(PostWarping, LeavesTargetsThatTheLinearEditorMet) {
  const bodies::ElasticBody body = reduced::testing::block(10, 2, 2, 0.1, true);
  bodies::ModalOptions wanted;
  wanted.mode_count = 12;
  const reduced::ScaledModes modes =
      reduced::scale_modes(body, bodies::modal_analysis(body, wanted));
  const std::shared_ptr<Reconstruction> linear = reduced::make_linear_reconstruction(body, modes);
  const std::shared_ptr<Reconstruction> full = reduced::make_full_reconstruction(body, modes);
  const double length = full->length();
  const int tip = body.mesh.node_count() - 1;
  const auto miss = [&](const Reconstruction& shapes, const EditedMotion& edited,
                        const Eigen::Vector3d& target) {
    const Eigen::MatrixXd u = shapes.displacements(kEditedFrame, edited.motion.col(kEditedFrame));
    return (u.col(0).segment<3>(3 * Eigen::Index{tip}) - target).norm() / length;
  };
  double before = 0;
  for (const double far : {0.05, 0.1, 0.2, 0.4}) {
    const Eigen::Vector3d target(0, 0, far * length);
    const EditedMotion by_linear = edit(linear, modes, tip, target);
    ASSERT_EQ(by_linear.report.status, spacetime::SolveStatus::kConverged);
    EXPECT_LT(miss(*linear, by_linear, target), 1e-4) << far;
    const double warped = miss(*full, by_linear, target);
    EXPECT_GT(warped, 0.1 * far * far) << far;  // of second order in what is asked
    EXPECT_GT(warped, 2 * before) << far;
    before = warped;
    const EditedMotion by_full = edit(full, modes, tip, target);
    ASSERT_EQ(by_full.report.status, spacetime::SolveStatus::kConverged);
    EXPECT_LT(miss(*full, by_full, target), 1e-4) << far;
  }
}

}  // namespace
}  // namespace limber::session
