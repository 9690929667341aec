// Linkages that are cut into more edges where an edit asks more of them than their tolerance
// allows.

#include "engine/session/linkages/refinement.h"

#include <gtest/gtest.h>

#include "engine/session/linkages/document.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session::testing {
namespace {

scene::Linkage tolerant(double tolerance) {
  scene::Linkage linkage = hyperboloid();
  linkage.edges_per_segment = 0;
  linkage.tolerance = tolerance;
  linkage.conditions.mean_angle = 15 * kDegree;
  return linkage;
}

Eigen::Matrix3Xd joints_of(const LinkageResult& result) {
  return result.shape->joints(result.frames->rightCols<1>());
}

double distance(const LinkageResult& a, const LinkageResult& b) {
  return (joints_of(a) - joints_of(b)).colwise().norm().maxCoeff();
}

TEST(Refinement, AnEditThatTakesMoreEdgesGetsThem) {
  constexpr double kTolerance = 1.5e-4;
  LiveSession live(tolerant(kTolerance));
  const auto opened = live.recorder->wait_checked(0);
  ASSERT_TRUE(opened && opened->shape_check);
  EXPECT_TRUE(opened->shape_check->within_tolerance());
  const int edges = live.session.linkage().edges_per_segment;

  const auto coarse = live.edit({SetMeanAngle{85 * kDegree}});
  ASSERT_TRUE(coarse && coarse->report.converged());
  const auto fine = live.recorder->wait_checked(coarse->revision);
  ASSERT_TRUE(fine && fine->shape_check) << (fine ? fine->check_failure : "");
  EXPECT_GT(live.session.linkage().edges_per_segment, edges) << fine->report.message;
  EXPECT_TRUE(fine->shape_check->within_tolerance()) << fine->report.message;
  EXPECT_TRUE(fine->report.converged());
  EXPECT_NE(fine->report.message.find("edges per segment in place of"), std::string::npos);
  EXPECT_NE(fine->geometry->hash, coarse->geometry->hash);
  EXPECT_EQ(fine->geometry, live.session.geometry());
  EXPECT_EQ(fine->frames->rows(), fine->geometry->coordinates);
  EXPECT_GT(distance(*fine, *coarse), 0);

  // As opened with these conditions.
  scene::Linkage scene = tolerant(kTolerance);
  scene.conditions.mean_angle = 85 * kDegree;
  LiveSession fresh(scene);
  const auto reference = fresh.recorder->wait_checked(0);
  ASSERT_TRUE(reference && reference->shape_check);
  EXPECT_LT(distance(*fine, *reference), 2 * kTolerance * fine->shape_check->size);

  const auto next = live.edit({SetMeanAngle{84 * kDegree}});
  ASSERT_TRUE(next && next->report.converged());
  EXPECT_EQ(next->geometry, fine->geometry) << "the next edit stays with them";
}

TEST(Refinement, UndoAcrossItComesBackToTheShapeWithinTheTolerance) {
  constexpr double kTolerance = 1.5e-4;
  LiveSession live(tolerant(kTolerance));
  const auto opened = live.recorder->wait_checked(0);
  ASSERT_TRUE(opened);
  const auto coarse = live.edit({SetMeanAngle{85 * kDegree}});
  ASSERT_TRUE(coarse);
  const auto fine = live.recorder->wait_checked(coarse->revision);
  ASSERT_TRUE(fine && fine->geometry->hash != opened->geometry->hash);
  const auto back = live.edit({Undo{}});
  ASSERT_TRUE(back && back->report.converged());
  EXPECT_LT(distance(*back, *opened), 2 * kTolerance * fine->shape_check->size);
  const auto again = live.edit({Redo{}});
  ASSERT_TRUE(again && again->report.converged());
  EXPECT_EQ(again->geometry, fine->geometry);
  EXPECT_LT(distance(*again, *fine), 1e-6 * fine->shape_check->size);
}

TEST(Refinement, EdgesThatASceneNamesAreKept) {
  scene::Linkage linkage = tolerant(1e-5);
  linkage.edges_per_segment = 5;
  LiveSession live(linkage);
  const auto coarse = live.edit({SetMeanAngle{85 * kDegree}});
  ASSERT_TRUE(coarse);
  const auto checked = live.recorder->wait_checked(coarse->revision);
  ASSERT_TRUE(checked && checked->shape_check);
  EXPECT_FALSE(checked->shape_check->within_tolerance());
  EXPECT_EQ(live.session.linkage().edges_per_segment, 5);
  EXPECT_EQ(checked->geometry, coarse->geometry);
}

TEST(Refinement, AToleranceThatCannotBeMetIsSaidToBeMissed) {
  LinkageLimits limits;
  limits.most_chosen_edges = 8;
  auto recorder = std::make_shared<LinkageRecorder>();
  test::Pool pool{1};
  LinkageSession session("live", tolerant(1e-5), limits, pool.executor(), recorder);
  const auto checked = recorder->wait_checked(session.edit({SetMeanAngle{85 * kDegree}}).revision);
  ASSERT_TRUE(checked && checked->shape_check);
  EXPECT_EQ(session.linkage().edges_per_segment, 8);
  EXPECT_FALSE(checked->shape_check->within_tolerance());
  EXPECT_NE(checked->report.message.find("tolerance"), std::string::npos);
}

TEST(Refinement, AnEditThatComesEarlierInterruptsIt) {
  LiveSession live(tolerant(1e-4));
  ASSERT_TRUE(live.recorder->wait_checked(0));
  Revision last = 0;
  for (int step = 0; step < 30; ++step)
    last = live.session.edit({SetMeanAngle{(70 + 0.5 * step) * kDegree}}).revision;
  const auto checked = live.recorder->wait_checked(last);
  ASSERT_TRUE(checked && checked->shape_check);
  EXPECT_EQ(checked->revision, last);
  EXPECT_TRUE(checked->shape_check->within_tolerance()) << checked->report.message;
  EXPECT_NEAR(checked->mean_angle, 84.5 * kDegree, 1e-9);
  EXPECT_FALSE(live.recorder->has_gap());
}

/// Segments between joints that lie where they did, as where one has buckled to the other side.
TEST(Refinement, AShapeOnAnotherBranchIsNotTaken) {
  const scene::Linkage linkage = tolerant(1e-5);
  LiveSession live(linkage);
  const auto opened = live.recorder->wait_checked(0);
  ASSERT_TRUE(opened && opened->shape_check);
  ShapeCheck found = *opened->shape_check;
  found.error.max_distance = 1e-3 * found.size;
  const int edges = live.session.linkage().edges_per_segment;
  EXPECT_TRUE(refine(linkage, *opened, found, edges, 60).live) << "its own branch is found";

  Eigen::MatrixXd frames = *opened->frames;
  Eigen::Index at = 0;
  for (const int of_segment : opened->geometry->edges) {
    if (of_segment >= 4)
      frames.block(at + 3 * Eigen::Index{of_segment / 2}, frames.cols() - 1, 3, 1).array() +=
          0.02 * found.size;
    at += 6 * Eigen::Index{of_segment} + 3;
  }
  LinkageResult elsewhere = *opened;
  elsewhere.frames = std::make_shared<const Eigen::MatrixXd>(frames);
  ASSERT_LT(distance(elsewhere, *opened), 1e-9);
  const Refinement refined = refine(linkage, elsewhere, found, edges, 60);
  EXPECT_FALSE(refined.live);
  EXPECT_NE(refined.failure.find("another equilibrium"), std::string::npos);
}

}  // namespace
}  // namespace limber::session::testing
