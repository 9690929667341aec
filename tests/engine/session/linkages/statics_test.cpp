// What the rods of a live linkage carry.
#include "engine/session/linkages/statics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/degrees.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/session/linkages/files.h"
#include "engine/session/linkages/live_problem.h"

namespace limber::session {
namespace {

struct Solved {
  explicit Solved(const scene::Linkage& linkage) : live(linkage) {
    outcome = live.solve(std::make_shared<scene::LinkageConditions>(linkage.conditions), {}, [] {});
    EXPECT_TRUE(outcome.reached) << outcome.report.message;
    EXPECT_EQ(outcome.path.size(), outcome.strains.size());
    detail = live.statics()->detail(outcome.frames.back(), outcome.strains.back());
  }
  LiveLinkage live;
  LiveLinkage::Outcome outcome;
  LinkageDetail detail;
};

scene::Linkage opened_hyperboloid() {
  scene::Linkage linkage = scene::make_linkage_sample("hyperboloid");
  linkage.edges_per_segment = 6;
  linkage.conditions = {};
  linkage.conditions.mean_angle = 40 * kDegree;
  return linkage;
}

/// The same in millimetres.
scene::Linkage in_millimetres(scene::Linkage linkage) {
  linkage.length_unit_in_metres = 1e-3;
  linkage.lines.vertices *= 1000;
  auto& section = std::get<rods::Rectangle>(linkage.section);
  section = {section.width * 1000, section.height * 1000};
  return linkage;
}

TEST(LinkageStatics, StressesDoNotDependOnTheUnit) {
  const scene::Linkage linkage = opened_hyperboloid();
  ASSERT_EQ(linkage.length_unit_in_metres, 1);
  const Solved metres(linkage), millimetres(in_millimetres(linkage));
  const auto same = [&](rods::RodField field, double scale) {
    const Eigen::RowVectorXd a = metres.detail.fields.row(field);
    const Eigen::RowVectorXd b = scale * millimetres.detail.fields.row(field);
    EXPECT_GT(a.cwiseAbs().maxCoeff(), 0);
    EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-3 * a.cwiseAbs().maxCoeff()) << field;
  };
  same(rods::kBendingMoment2, 1);
  same(rods::kTorque, 1);
  same(rods::kCurvature2, 1000);
  same(rods::kLargestNormal, 1);
  same(rods::kTorsionShear, 1);
  same(rods::kVonMises, 1);
}

TEST(LinkageStatics, EnergyIsThatOfTheReport) {
  const Solved solved(opened_hyperboloid());
  // Over stations: half of moment times curvature, a rest length each; joints' edges count by
  // halves.
  double energy = 0;
  const auto& fields = solved.detail.fields;
  for (std::size_t s = 0; s < solved.detail.segments.size(); ++s) {
    const int first = solved.detail.first[s], edges = solved.detail.first[s + 1] - first - 1;
    const double length = solved.detail.segments[s].rest_length / (edges - 1);
    for (int i = 1; i < edges; ++i) {
      energy += 0.5 * length *
                (fields(rods::kBendingMoment1, first + i) * fields(rods::kCurvature1, first + i) +
                 fields(rods::kBendingMoment2, first + i) * fields(rods::kCurvature2, first + i) +
                 fields(rods::kTorque, first + i) * fields(rods::kTwistRate, first + i));
    }
  }
  const auto& report = solved.outcome.report.energies;
  const double wanted = report.bending + report.twisting;
  EXPECT_GT(wanted, 0);
  EXPECT_NEAR(energy, wanted, 0.02 * wanted);  // edges of a segment are nearly of one length
}

TEST(LinkageStatics, StationsReachFromJointToJoint) {
  const Solved solved(opened_hyperboloid());
  const LinkageDetail& detail = solved.detail;
  double angles = 0;
  for (std::size_t j = 0; j < detail.joints.size(); ++j) {
    const auto& state = solved.live.state().joints()[j];
    EXPECT_LT((detail.joints[j].position - state.position).norm(), 1e-5);
    EXPECT_LT((detail.joints[j].normal - state.normal).norm(), 1e-4);
    angles += detail.joints[j].opening_angle;
  }
  EXPECT_NEAR(angles / static_cast<double>(detail.joints.size()), 40 * kDegree, 1e-6);
  for (std::size_t s = 0; s < detail.segments.size(); ++s) {
    for (std::size_t end = 0; end < 2; ++end) {
      const int joint = detail.segments[s].joints[end];
      if (joint < 0) continue;
      const int station = end == 0 ? detail.first[s] : detail.first[s + 1] - 1;
      EXPECT_LT(
          (detail.points.col(station) - detail.joints[static_cast<std::size_t>(joint)].position)
              .norm(),
          1e-5);
    }
    double length = 0;
    for (int i = detail.first[s]; i + 1 < detail.first[s + 1]; ++i)
      length += (detail.points.col(i + 1) - detail.points.col(i)).norm();
    EXPECT_NEAR(length, detail.segments[s].length, 1e-5 * length);
  }
}

TEST(LinkageFiles, CentrelinesShareTheirJoints) {
  const Solved solved(opened_hyperboloid());
  const scene::Polylines lines = linkage_centrelines(solved.detail);
  ASSERT_EQ(lines.lines.size(), solved.detail.segments.size());
  for (std::size_t s = 0; s < lines.lines.size(); ++s) {
    EXPECT_EQ(lines.lines[s].size(), 7u);
    if (solved.detail.segments[s].joints[0] >= 0) {
      EXPECT_EQ(lines.lines[s].front(), solved.detail.segments[s].joints[0]);
    }
  }
  const scene::Polylines carried = linkage_lines(solved.detail);
  EXPECT_EQ(carried.points.cols(), solved.detail.points.cols());
  EXPECT_EQ(carried.point_data.size(), std::size_t{rods::kRodFields} + 1);
}

TEST(LinkageFiles, StressesWithoutBoundAreLeftOut) {
  scene::Linkage linkage = opened_hyperboloid();
  linkage.section = rods::LSection{0.02, 0.02, 0.004};
  const Solved solved(linkage);
  for (const auto& array : linkage_lines(solved.detail).point_data) {
    EXPECT_TRUE(array.values.allFinite()) << array.name;
    EXPECT_NE(array.name, name_of(rods::kVonMises).name);
  }
}

}  // namespace
}  // namespace limber::session
