// Designs where searches break.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "engine/base/error.h"
#include "engine/base/start_shift.h"
#include "engine/rods/design/compare_designs.h"
#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/linkage_cells.h"
#include "engine/rods/design/mesh_surface.h"
#include "engine/rods/linkage/joint_positions.h"
#include "tests/engine/rods/design/small_designs.h"

namespace limber::rods {
namespace {

/// Rods that run aslant in a plane, and stay there as long as they fit.
LinkageModel planar_model() {
  LineMesh mesh = testing::sheared_grid(4, 4, 0.6, 40);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Eigen::Vector3d x = mesh.vertices.col(v);
    mesh.vertices.col(v).x() += 6 * std::sin(0.03 * x.y());
    mesh.vertices.col(v).y() += 5 * std::sin(0.025 * x.x());
  }
  return {build_linkage_graph(mesh), 6, testing::kStrip};
}

/// One triangle, and rows of them on a plane.
SurfaceMesh square(const Eigen::Vector3d& middle, double half) {
  SurfaceMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << -half, half, half, -half, -half, -half, half, half, 0, 0, 0, 0;
  mesh.vertices.colwise() += middle;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  return mesh;
}

class HardDesigns : public ::testing::Test {
 protected:
  void open(LinkageModel linkage, double opening) {
    model_.emplace(std::move(linkage));
    LinkageState state(*model_);
    LinkageEquilibrium equilibrium(*model_);
    flat_ = {};
    flat_.pins = {{5}};
    ASSERT_TRUE(equilibrium.solve(state, flat_).converged());
    flat_.mean_opening_angle = state.mean_opening_angle();
    LinkageState opened = state;
    deployed_.pins = flat_.pins;
    deployed_.mean_opening_angle = state.mean_opening_angle() + opening;
    ASSERT_EQ(deploy(equilibrium, opened, deployed_).status, DeploymentStatus::kReached);
    start_.emplace(DesignPoint{model_->segment_lengths(), state, opened});
  }
  [[nodiscard]] LinkageDesign design() const {
    return {*model_, flat_, deployed_, *start_, criteria_};
  }
  [[nodiscard]] double rms(const DesignValues& values) const {
    return std::sqrt(2 * values.distance / model_->variables().joints());
  }

  std::optional<LinkageModel> model_;
  Conditions flat_, deployed_;
  std::optional<DesignPoint> start_;
  DesignCriteria criteria_;
  DesignOptimizerOptions options_;
};

TEST_F(HardDesigns, ATargetThatCannotBeReached) {
  open(testing::curved_model(), 0.4);
  flat_.mean_opening_angle.reset();
  // Within bounds of a tenth nothing becomes a point.
  criteria_.surface = std::make_shared<MeshSurface>(square({80, 60, 50}, 1e-3));
  criteria_.distance_weight = 1e5;
  options_.shortest = 0.9;
  options_.longest = 1.1;
  options_.flat_height = 0.2;
  LinkageDesign design = this->design();
  const DesignReport report = optimize_design(design, options_);
  EXPECT_LT(report.after.objective, report.before.objective);
  EXPECT_GT(rms(report.after), 10);
  EXPECT_LE(report.flat_height, options_.flat_height * 1.001);
  EXPECT_FALSE(report.message.empty());
  const Eigen::ArrayXd share = design.point().lengths.cwiseQuotient(start_->lengths).array();
  EXPECT_GE(share.minCoeff(), 0.9 - 1e-12);
  EXPECT_LE(share.maxCoeff(), 1.1 + 1e-12);
  EXPECT_FALSE(report.at_bound.empty());
}

/// Opened, a plane grid stores what rounding says: no scale for energies.
TEST_F(HardDesigns, AMechanismReachesWhatItCanReach) {
  open(testing::grid_model(5, 5, 0.5), 0.5);
  const Eigen::Matrix3Xd here = joint_positions(start_->deployed);
  const Eigen::Vector3d held = here.col(5);
  for (int j = 0; j < here.cols(); ++j)
    criteria_.targets.push_back({j, held + 1.03 * (here.col(j) - held), 1});
  options_.max_iterations = 40;
  options_.flat_height = 0.05;
  for (const BucklingGuard guard : {BucklingGuard::kWhenNeeded, BucklingGuard::kFromStart}) {
    options_.guard = guard;
    LinkageDesign design = this->design();
    EXPECT_GT(design.criteria().energy_scale, 0.1 * testing::kStrip.bending_2 / 500);
    const DesignReport report = optimize_design(design, options_);
    EXPECT_GT(rms(report.before), 1);
    EXPECT_LT(rms(report.after), 1e-3 * rms(report.before)) << report.message;
  }
}

TEST_F(HardDesigns, ADesignWhoseFlatStateBuckles) {
  open(planar_model(), 0.3);
  LinkageDesign design = this->design();
  const DesignValues before = design.values(design.point());
  EXPECT_LT(before.flatness, 1e-12);
  // Rods of one direction too long by turns: they do not fit into a plane.
  bool buckled = false;
  for (const double share : {0.03, 0.1, 0.3}) {
    Eigen::VectorXd lengths = start_->lengths;
    for (Eigen::Index s = 0; s < lengths.size(); ++s) lengths[s] *= 1 + (s % 3 == 0 ? share : 0);
    const DesignTrial trial = design.trial(lengths);
    if (trial.status == TrialStatus::kFound) continue;
    buckled = buckled || trial.lost == LostShape::kFlat;
    EXPECT_FALSE(trial.message.empty());
  }
  EXPECT_TRUE(buckled);
  EXPECT_EQ(design.values(design.point()).objective, before.objective);

  // A search towards what random lengths deploy to keeps flat all the same, and says what it lost.
  LinkageModel other = *model_;
  const Eigen::VectorXd lengths = testing::varied(start_->lengths, 0.04, 3);
  LinkageEquilibrium equilibrium(other);
  LinkageState wanted = start_->deployed;
  for (int k = 1; k <= 10; ++k) {
    other.set_segment_lengths(start_->lengths + 0.1 * k * (lengths - start_->lengths));
    ASSERT_TRUE(equilibrium.solve(wanted, deployed_).converged());
  }
  DesignCriteria criteria = criteria_;
  criteria.surface = std::make_shared<MeshSurface>(
      surface_through_joints(model_->graph(), joint_positions(wanted)));
  criteria.distance_weight = 1e7;
  options_.max_iterations = 60;
  design.set_criteria(criteria);
  const DesignReport report = optimize_design(design, options_);
  EXPECT_GT(report.not_believed, 0);
  EXPECT_LE(report.flat_height, options_.flat_height * 1.001);
  EXPECT_LT(rms(report.after), 0.8 * rms(report.before)) << report.message;
  EXPECT_FALSE(report.message.empty());
}

TEST_F(HardDesigns, ClosestPointsOnTheRimAndAtVertices) {
  open(testing::curved_model(), 0.4);
  // A small square amid the linkage: closest points are in it, on its rim and at its corners.
  criteria_.surface = std::make_shared<MeshSurface>(square({100, 50, 5}, 30));
  criteria_.distance_weight = 100;
  LinkageDesign design = this->design();
  int ranks[3] = {0, 0, 0};
  for (const auto& joint : design.point().deployed.joints())
    ++ranks[std::lround(criteria_.surface->closest(joint.position).derivative.trace())];
  EXPECT_GT(ranks[0], 0);
  EXPECT_GT(ranks[1], 0);
  EXPECT_GT(ranks[2], 0);
  const Eigen::VectorXd lengths = design.point().lengths;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Eigen::VectorXd v = testing::random_direction(lengths.size(), seed);
    const auto value = [&](double h) {
      const DesignTrial trial = design.trial(lengths + h * v);
      EXPECT_EQ(trial.status, TrialStatus::kFound) << trial.message;
      return design.values(trial.point).objective;
    };
    constexpr double kStep = 1e-3;
    const double difference =
        (8 * (value(kStep) - value(-kStep)) - (value(2 * kStep) - value(-2 * kStep))) /
        (12 * kStep);
    EXPECT_NEAR(design.gradients().objective.dot(v), difference,
                1e-6 * design.gradients().objective.norm());
  }
}

TEST_F(HardDesigns, AJointAngleAtItsBound) {
  open(testing::curved_model(), 0.4);
  flat_.mean_opening_angle.reset();
  Eigen::Matrix3Xd wanted = joint_positions(start_->deployed);
  for (Eigen::Index j = 0; j < wanted.cols(); ++j)
    criteria_.targets.push_back({static_cast<int>(j), 1.02 * wanted.col(j), 1});
  criteria_.distance_weight = 1e5;
  options_.flat_height = 0.2;
  LinkageDesign free = design();
  const DesignReport unbound = optimize_design(free, options_);
  // The start stands at the bound, or beyond it where the path leads there.
  for (const double beyond : {0.0, 0.02}) {
    LinkageDesign design = this->design();
    options_.smallest_angle =
        std::max(unbound.before.smallest_angle, unbound.after.smallest_angle) + beyond;
    const DesignReport report = optimize_design(design, options_);
    EXPECT_GE(report.after.smallest_angle, options_.smallest_angle - 2e-3) << report.message;
    EXPECT_LT(report.after.objective, report.before.objective);
  }
}

TEST_F(HardDesigns, ASmallestAngleThatNoDesignHas) {
  open(testing::curved_model(), 0.4);
  flat_.mean_opening_angle.reset();
  const Eigen::Matrix3Xd wanted = joint_positions(start_->deployed);
  for (Eigen::Index j = 0; j < wanted.cols(); ++j)
    criteria_.targets.push_back({static_cast<int>(j), 1.02 * wanted.col(j), 1});
  criteria_.distance_weight = 1e5;
  options_.flat_height = 0.2;
  // Lengths that differ by a thousandth do not fold rods onto each other.
  options_.smallest_angle = 3;
  options_.shortest = 0.999;
  options_.longest = 1.001;
  LinkageDesign design = this->design();
  const DesignReport report = optimize_design(design, options_);
  // Whether a last tiny step still brings the bound nearer, and the search is stuck after it, is up
  // to the last digits.
  EXPECT_TRUE(report.status == DesignStatus::kInfeasible || report.status == DesignStatus::kStuck)
      << report.message;
  EXPECT_LT(report.after.smallest_angle, options_.smallest_angle - 0.1);
  EXPECT_LT(report.iterations, options_.max_iterations);
  EXPECT_NE(report.message.find("limit 171.89"), std::string::npos) << report.message;
}

TEST_F(HardDesigns, AnEquilibriumThatDisappearsUnderAParameterStep) {
  open(planar_model(), 0.3);
  LinkageDesign design = this->design();
  // Along these lengths the flat shape ceases to be one: followed in ever smaller steps, the path
  // ends, and no trial beyond the end is believed.
  Eigen::VectorXd direction = start_->lengths;
  for (Eigen::Index s = 0; s < direction.size(); ++s) direction[s] *= s % 3 == 0 ? 0.4 : 0;
  double reached = 0, step = 0.02;
  while (step > 1e-7 && reached < 1) {
    const DesignTrial trial = design.trial(start_->lengths + (reached + step) * direction);
    if (trial.status == TrialStatus::kFound) {
      design.move_to(trial.point);
      reached += step;
      continue;
    }
    EXPECT_NE(trial.lost, LostShape::kNone);
    step /= 4;
  }
  EXPECT_LT(step, 1e-6);
  EXPECT_GT(reached, 0);
  EXPECT_LT(reached, 1);
  for (const double beyond : {1e-4, 1e-2, 0.2}) {
    const DesignTrial trial = design.trial(start_->lengths + (reached + beyond) * direction);
    EXPECT_NE(trial.status, TrialStatus::kFound) << beyond;
  }
  EXPECT_LT(design.values(design.point()).flatness, 1e-9);
}

TEST_F(HardDesigns, WhereTheDeployedShapesBranchEndsTheSearchContinuesFromTheNext) {
  const LinkageModel even = testing::curved_model();
  open(even, 0.4);
  const int joint = even.variables().joints() - 1;
  const Eigen::Vector3d wanted =
      start_->deployed.joints()[joint].position + Eigen::Vector3d(0.5, 0.3, 0.4);
  options_.flat_height = 0.3;
  options_.max_iterations = 60;
  int left = 0;
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U, 6U}) {
    LinkageModel uneven = even;
    uneven.set_segment_lengths(testing::varied(even.segment_lengths(), 0.015, seed));
    open(uneven, 0.4);
    criteria_.targets = {{joint, wanted, 1}};
    criteria_.distance_weight = 1e8;
    LinkageDesign design = this->design();
    const DesignReport report = optimize_design(design, options_);
    EXPECT_LT(report.after.objective, report.before.objective) << seed;
    EXPECT_EQ(report.message.find("branch") != std::string::npos, report.branches_left > 0);
    left += report.branches_left;
    // What it went on from is no less an equilibrium.
    LinkageModel found = *model_;
    set_sizes(found, design.point());
    LinkageEquilibrium equilibrium(found);
    LinkageState state = design.point().deployed;
    const EquilibriumReport here = equilibrium.solve(state, deployed_, {.max_escapes = 0});
    EXPECT_TRUE(here.converged()) << here.message;
    EXPECT_LE(here.iterations, start_shift() > 0 ? 1 : 0);
  }
  EXPECT_GT(left, 0);
}

TEST_F(HardDesigns, TwoStartsThatEndInDifferentOptima) {
  // A target of the surfaces that two designs deploy to. Joints slide in surfaces, so that more
  // than one design lies in it without energy: nothing is better than these.
  open(testing::curved_model(), 0.4);
  flat_.mean_opening_angle.reset();
  std::vector<DesignPoint> known;
  SurfaceMesh both;
  for (const unsigned seed : {3u, 4u}) {
    LinkageDesign design = this->design();
    testing::lead(design, testing::varied(start_->lengths, 0.04, seed), 10);
    known.push_back(design.point());
    const SurfaceMesh sheet =
        surface_through_joints(model_->graph(), joint_positions(design.point().deployed));
    const Eigen::Index vertices = both.vertices.cols(), triangles = both.triangles.cols();
    both.vertices.conservativeResize(3, vertices + sheet.vertices.cols());
    both.vertices.rightCols(sheet.vertices.cols()) = sheet.vertices;
    both.triangles.conservativeResize(3, triangles + sheet.triangles.cols());
    both.triangles.rightCols(sheet.triangles.cols()) =
        sheet.triangles.array() + static_cast<int>(vertices);
  }
  criteria_.surface = std::make_shared<MeshSurface>(both);
  criteria_.distance_weight = 1e5;
  options_.flat_height = 0.2;
  options_.max_iterations = 50;
  std::vector<DesignPoint> ends;
  for (const std::size_t k : {0, 1, 0}) {
    start_ = known[k];
    LinkageDesign design = this->design();
    const double slope = design.gradients().objective.norm();
    const DesignReport report = optimize_design(design, options_);
    EXPECT_TRUE(report.status == DesignStatus::kConverged ||
                report.status == DesignStatus::kSettled)
        << report.message;
    EXPECT_LT(report.after.objective, 1e-8 * report.before.objective);
    EXPECT_LT(design.gradients().objective.norm(), 1e-4 * slope);
    ends.push_back(design.point());
  }
  const double size = design().criteria().length_scale;
  const DesignDifference difference = compare_designs(ends[0], ends[1]);
  EXPECT_FALSE(difference.same(size));
  EXPECT_GT(difference.lengths, 0.01);
  EXPECT_GT(difference.deployed, 0.001 * size);
  EXPECT_TRUE(compare_designs(ends[0], ends[2]).same(size, 1e-12));
}

TEST_F(HardDesigns, BadInputLeavesTheDesignIntact) {
  open(testing::curved_model(), 0.4);
  LinkageDesign design = this->design();
  const DesignValues before = design.values(design.point());
  const auto refused = [&](const auto& spoil) -> std::string {
    DesignCriteria criteria = design.criteria();
    DesignOptimizerOptions options = options_;
    spoil(criteria, options);
    try {
      design.set_criteria(criteria);
      (void)optimize_design(design, options);
    } catch (const Error& error) {
      return error.field();
    }
    return "none";
  };
  using Criteria = DesignCriteria;
  using Options = DesignOptimizerOptions;
  EXPECT_EQ(refused([](Criteria& c, Options&) { c.distance_weight = -1; }), "distance_weight");
  EXPECT_EQ(refused([](Criteria& c, Options&) { c.surface_weight = -1; }), "surface_weight");
  EXPECT_EQ(refused([](Criteria& c, Options&) {
              c.joint_surface_weights.setOnes(16);
              c.joint_surface_weights[3] = -0.5;
            }),
            "joint_surface_weights[3]");
  EXPECT_EQ(refused([](Criteria& c, Options&) { c.joint_surface_weights.setOnes(3); }),
            "joint_surface_weights");
  EXPECT_EQ(refused([](Criteria& c, Options&) { c.distance_weight = 1e300; }), "distance_weight");
  const Eigen::VectorXd lengths = start_->lengths;
  EXPECT_EQ(refused([&](Criteria&, Options& o) {
              o.shortest_lengths = 0.9 * lengths;
              o.shortest_lengths[4] = 1.01 * lengths[4];
            }),
            "shortest_lengths[4]");
  EXPECT_EQ(refused([&](Criteria&, Options& o) {
              o.longest_lengths = 1.1 * lengths;
              o.longest_lengths[2] = 0.99 * lengths[2];
            }),
            "longest_lengths[2]");
  EXPECT_EQ(refused([&](Criteria&, Options& o) { o.longest_lengths.setOnes(2); }),
            "longest_lengths");
  EXPECT_EQ(design.point().lengths, lengths);
  EXPECT_EQ(design.values(design.point()).objective, before.objective);
}

}  // namespace
}  // namespace limber::rods
