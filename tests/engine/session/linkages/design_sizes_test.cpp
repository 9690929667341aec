// Designs by rest lengths of edges and by sections; what a design says of its trials and of others.

#include <gtest/gtest.h>

#include "tests/engine/session/linkages/live_designs.h"

namespace limber::session {
namespace {

using namespace limber::session::testing;

constexpr rods::DesignVariables kEdges{rods::LengthVariables::kEdges,
                                       rods::SectionVariables::kKept};
constexpr rods::DesignVariables kBoth{rods::LengthVariables::kSegments,
                                      rods::SectionVariables::kSegments};
constexpr rods::DesignVariables kSections{rods::LengthVariables::kKept,
                                          rods::SectionVariables::kSegments};

TEST(DesignSizes, OfEdgesAreTakenUndoneAndOpenedAgain) {
  LiveDesignSession live;
  const auto before = live.watcher->wait_final(0);
  DesignRequest wanted = request();
  wanted.variables = kEdges;
  live.session.start_design(wanted);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  ASSERT_TRUE(end->taken) << end->message;
  EXPECT_LT(end->best.target_rms, end->start.target_rms / 20);
  const auto shape = live.watcher->wait_final(1);
  ASSERT_TRUE(shape);
  EXPECT_FALSE(shape->solve_failed) << shape->report.message;
  const auto conditions = live.session.conditions();
  const Eigen::Index edges = 40 * 5 - 30;  // a joint's edge is one of two segments
  EXPECT_EQ(conditions->edge_lengths.size(), edges);
  EXPECT_EQ(conditions->segment_lengths.size(), 0);
  EXPECT_EQ(conditions->edge_lengths, live.session.best_design()->sizes.edges);
  // Lengths of segments would say other ones.
  EXPECT_TRUE(shape->statics->by_edges());
  DesignRequest segments = request();
  EXPECT_EQ(refused_field([&] { live.session.start_design(segments); }), "lengths");

  LiveDesignSession other(live.session.linkage());
  const auto opened = other.watcher->wait_final(0);
  ASSERT_TRUE(opened);
  EXPECT_NEAR(opened->report.energies.total(), shape->report.energies.total(),
              1e-5 * shape->report.energies.total());

  const auto undone = live.edit({Undo{}});
  EXPECT_EQ(live.joints(*undone), live.joints(*before)) << "the very answer";
  EXPECT_EQ(live.session.conditions()->edge_lengths.size(), 0);
  const auto redone = live.edit({Redo{}});
  EXPECT_EQ(live.joints(*redone), live.joints(*shape));
}

TEST(DesignSizes, SectionsAreTakenWithLengthsInOneStepOfUndo) {
  LiveDesignSession live;
  DesignRequest wanted = request();
  wanted.variables = kBoth;
  wanted.goal.distance_weight = 1e6;
  live.session.start_design(wanted);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  if (!end->taken) live.session.take_design();
  const auto shape = live.watcher->wait_final(1);
  ASSERT_TRUE(shape);
  EXPECT_FALSE(shape->solve_failed) << shape->report.message;
  const auto conditions = live.session.conditions();
  ASSERT_EQ(conditions->section_scales.size(), 40);
  EXPECT_EQ(conditions->segment_lengths.size(), 40);
  EXPECT_GT((conditions->section_scales.array() - 1).abs().maxCoeff(), 0.01);
  EXPECT_EQ(shape->section_scales, conditions->section_scales);
  bool reported = false;  // of intermediate shapes too
  for (const auto& result : live.watcher->results())
    reported = reported || (result->design && result->section_scales.size() == 40 &&
                            !result->section_scales.isOnes(1e-3));
  EXPECT_TRUE(reported);
  EXPECT_GE(conditions->section_scales.minCoeff(), 0.5);
  EXPECT_LE(conditions->section_scales.maxCoeff(), 2);
  // It is the equilibrium that the design had found.
  EXPECT_NEAR(shape->report.energies.total(), end->best.deployed_energy,
              1e-4 * end->best.deployed_energy);
  EXPECT_EQ(shape->statics->model().section_scales(), conditions->section_scales);
  live.edit({Undo{}});
  EXPECT_EQ(live.session.conditions()->section_scales.size(), 0);
  EXPECT_EQ(live.session.conditions()->segment_lengths.size(), 0);
}

TEST(DesignSizes, SectionsAloneGoWhereEnergyIsLeastAndStopAtTheirBounds) {
  LiveDesignSession live;
  DesignRequest wanted = request();
  wanted.variables = kSections;
  wanted.goal.distance_weight = 0;
  wanted.thinnest = 0.8;
  wanted.thickest = 1.1;
  live.session.start_design(wanted);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_LT(end->best.objective, end->start.objective);
  EXPECT_GT(end->sections_at_bound.size(), 20U);
  EXPECT_TRUE(end->at_bound.empty());
  EXPECT_GE(live.session.best_design()->sizes.sections.minCoeff(), 0.8);
}

TEST(DesignSizes, AreEditsThatTheShapeFollowsAndWeighs) {
  LiveDesignSession live;
  const auto before = live.watcher->wait_final(0);
  const Eigen::VectorXd twice = Eigen::VectorXd::Constant(40, 2);
  const auto thick = live.edit({SetSectionScales{twice}});
  EXPECT_FALSE(thick->solve_failed) << thick->report.message;
  EXPECT_NEAR(thick->report.energies.bending, 16 * before->report.energies.bending,
              0.5 * thick->report.energies.bending);
  EXPECT_GT(thick->report.energies.bending, 4 * before->report.energies.bending);
  const LinkageDetail detail =
      thick->statics->detail(thick->frames->rightCols<1>(), thick->strains->rightCols<1>());
  EXPECT_EQ(detail.segments[3].section_scale, 2);
  // What is drawn of it is twice as thick.
  const Eigen::VectorXd column = thick->frames->rightCols<1>();
  const auto diagonal = [&](const Eigen::VectorXd& scales) {
    const Eigen::VectorXd surface = live.session.surface(column, scales);
    return (surface.segment<3>(0) - surface.segment<3>(6)).norm();
  };
  EXPECT_NEAR(diagonal(before->section_scales), std::hypot(6, 1.5), 1e-3);
  EXPECT_NEAR(diagonal(thick->section_scales), 2 * std::hypot(6, 1.5), 1e-3);
  // Of the model, edges as they are change nothing.
  const Eigen::VectorXd edges = thick->statics->model().edge_lengths();
  const auto same = live.edit({SetEdgeLengths{edges}});
  EXPECT_LT((live.joints(*same) - live.joints(*thick)).norm(), 1e-3);
  EXPECT_EQ(refused_field([&] { live.session.edit({SetEdgeLengths{edges.head(7)}}); }),
            "edits[0].edge_lengths");
  EXPECT_EQ(refused_field([&] { live.session.edit({SetEdgeLengths{100 * edges}}); }),
            "edits[0].edge_lengths[0]");
  EXPECT_EQ(refused_field([&] { live.session.edit({SetSectionScales{twice.head(7)}}); }),
            "edits[0].section_scales");
  EXPECT_EQ(refused_field([&] { live.session.edit({SetSectionScales{-twice}}); }),
            "edits[0].section_scales[0]");
  EXPECT_EQ(refused_field([&] { live.session.edit({SetSectionScales{20 * twice}}); }),
            "edits[0].section_scales[0]");
}

TEST(DesignSizes, BadVariablesAndBoundsAreNamed) {
  LiveDesignSession live;
  const auto start = [&](const std::function<void(DesignRequest&)>& spoil) {
    DesignRequest bad = request();
    spoil(bad);
    return refused_field([&] { live.session.start_design(bad); });
  };
  EXPECT_EQ(start([](DesignRequest& bad) {
              bad.variables = {rods::LengthVariables::kKept, rods::SectionVariables::kKept};
            }),
            "lengths");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.thinnest = 1.2; }), "thinnest");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.thickest = 0.9; }), "thickest");
  EXPECT_EQ(start([](DesignRequest& bad) {
              bad.variables = kBoth;
              bad.thinnest_sections = Eigen::VectorXd::Constant(40, 0.5);
              bad.thinnest_sections[4] = 1.1;
            }),
            "thinnest_sections[4]");
  EXPECT_EQ(
      start([](DesignRequest& bad) { bad.thickest_sections = Eigen::VectorXd::Constant(40, 2); }),
      "thickest_sections");
  EXPECT_EQ(start([](DesignRequest& bad) {
              bad.variables = kEdges;
              bad.longest_lengths = Eigen::VectorXd::Constant(40, 100);
            }),
            "longest_lengths");
  EXPECT_EQ(start([](DesignRequest& bad) { bad.fitted_points = Eigen::Matrix3Xd::Zero(3, 4); }),
            "fitted_points");
}

/// Two starts, one goal without a least: energies alone say next to nothing of lengths, so that
/// each start stays where it is.
TEST(DesignSizes, TwoStartsThatEndInDifferentOptimaAreReported) {
  LiveDesignSession live;
  DesignRequest wanted = request();
  // One joint only: there are many linkages that have it there.
  wanted.goal.targets.resize(1);
  wanted.goal.targets[0].joint = 24;
  wanted.goal.targets[0].position =
      live.joints(*live.watcher->wait_final(0)).col(24) + Eigen::Vector3d(0.5, 0.3, 0.4);
  live.session.start_design(wanted, 1);
  const auto first = live.watcher->wait_end();
  ASSERT_TRUE(first);
  ASSERT_TRUE(first->end == DesignEnd::kConverged || first->end == DesignEnd::kSettled)
      << first->message;
  EXPECT_TRUE(first->other_optima.empty());
  ASSERT_TRUE(first->taken);

  // From where it ended it ends there again.
  live.watcher->forget();
  live.session.start_design(wanted, 2);
  const auto again = live.watcher->wait_end();
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->other_optima.empty());

  Eigen::VectorXd longer = live.lengths();
  Random random(3);
  for (double& length : longer) length *= random.uniform(0.985, 1.015);
  ASSERT_FALSE(live.edit({SetSegmentLengths{longer}})->solve_failed);
  live.watcher->forget();
  live.session.start_design(wanted, 3);
  const auto other = live.watcher->wait_end();
  ASSERT_TRUE(other);
  ASSERT_TRUE(other->end == DesignEnd::kConverged || other->end == DesignEnd::kSettled)
      << other->message;
  ASSERT_GE(other->other_optima.size(), 1U);
  EXPECT_EQ(other->other_optima[0].tag, 1U);
  EXPECT_GT(other->other_optima[0].difference.lengths, 0.01);
  EXPECT_GT(other->other_optima[0].terms.objective, 0);
  // Another goal has other optima, which is nothing to tell.
  live.watcher->forget();
  wanted.goal.targets[0].position.z() += 0.2;
  live.session.start_design(wanted, 4);
  const auto elsewhere = live.watcher->wait_end();
  ASSERT_TRUE(elsewhere);
  EXPECT_TRUE(elsewhere->other_optima.empty());
}

TEST(DesignSizes, TrialsThatBuckleAreReported) {
  LiveDesignSession live;
  DesignRequest wanted = request();
  // Far more than the flat grid can be pressed.
  for (rods::JointTarget& target : wanted.goal.targets) target.position *= 1.4;
  wanted.flat_height = 0.02;
  wanted.max_iterations = 30;
  wanted.guard = rods::BucklingGuard::kNever;
  live.session.start_design(wanted);
  const auto end = live.watcher->wait_end();
  ASSERT_TRUE(end);
  EXPECT_EQ(end->guard, rods::BucklingGuard::kNever);
  for (const auto& info : live.watcher->infos()) {
    EXPECT_FALSE(info->trials.guarded);
    EXPECT_GE(info->trials.not_believed, info->trials.flat_lost);
  }
  EXPECT_GT(end->trials.flat_lost, 0);
  int lost = 0, reported = 0;
  for (const auto& info : live.watcher->infos()) {
    const bool lost_another = info->trials.not_believed > lost;
    lost = info->trials.not_believed;
    // One that was lost and then fallen from, to a better branch, is taken.
    if (info->accepted) {
      EXPECT_TRUE(info->trials.refusal.empty()) << info->trials.refusal;
    } else if (lost_another) {
      EXPECT_FALSE(info->trials.refusal.empty()) << info->iteration;
      ++reported;
    }
  }
  EXPECT_GT(reported, 0);
  live.watcher->forget();
  wanted.guard = rods::BucklingGuard::kFromStart;
  live.session.start_design(wanted);
  ASSERT_TRUE(live.watcher->wait_end());
  bool was_up = false;
  for (const auto& info : live.watcher->infos()) was_up = was_up || info->trials.guarded;
  EXPECT_TRUE(was_up);
}

}  // namespace
}  // namespace limber::session
