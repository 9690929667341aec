// The one conformance suite on the energy of whole linkages, and the energy written down a second
// time, from the public description of the model alone.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "tests/support/dense.h"

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/linkage_files.h"
#include "tests/engine/rods/linkage/mixed_linkage.h"
#include "tests/engine/rods/linkage/state_charts.h"
#include "tests/support/energy_conformance.h"

namespace limber::rods {
namespace {

using namespace testing;
using limber::testing::EnergyUnderTest;

struct BentAssembly {
  explicit BentAssembly(BendingForm form, int edges = 4)
      : model(build_linkage_graph(mixed_mesh()), edges, kStiffness, form),
        assembly(model),
        state(model) {
    Random random(11);
    for (int k = 0; k < 3; ++k)
      state = state.moved(model, random_increment(model.variables().size(), 0.2 / edges, random));
  }
  LinkageModel model;
  LinkageAssembly assembly;
  LinkageState state;
};

class LinkageConformance : public ::testing::TestWithParam<BendingForm> {};

TEST_P(LinkageConformance, OfTheElasticEnergy) {
  BentAssembly bent(GetParam());
  const Eigen::Index size = bent.model.variables().size();
  // Coordinates count from one, so that the suite's steps have a scale.
  const Eigen::VectorXd origin = Eigen::VectorXd::Ones(size);
  EnergyUnderTest energy;
  energy.value = [&](const Eigen::VectorXd& x) {
    return bent.assembly.energies(bent.state.moved(bent.model, x - origin)).total();
  };
  energy.gradient = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    const LinkageState moved = bent.state.moved(bent.model, x - origin);
    Eigen::VectorXd gradient(size);
    bent.assembly.gradient(moved, gradient);
    return pulled_back(bent.model, bent.state, x - origin, moved, gradient);
  };
  energy.hessian = [&](const Eigen::VectorXd& x) -> Eigen::MatrixXd {
    EXPECT_EQ(x, origin);  // Hessians are meant where unknowns are counted from
    Eigen::VectorXd gradient(size);
    CondensedMatrix matrix(bent.model.chains());
    bent.assembly.hessian(bent.state, gradient, matrix);
    return matrix.to_sparse();
  };
  energy.invariances = {[&](const Eigen::VectorXd&) -> Eigen::VectorXd {
    return origin + rigid_increment(bent.model, bent.state, {0.4, -0.9, 1.1}, {3, -1, 2});
  }};
  limber::testing::expect_conforms(energy, origin);
}

TEST_P(LinkageConformance, OfGradientsFarFromWhereUnknownsAreCounted) {
  BentAssembly bent(GetParam());
  Random random(5);
  const Eigen::VectorXd far = random_increment(bent.model.variables().size(), 0.3, random);
  EnergyUnderTest energy;
  energy.value = [&](const Eigen::VectorXd& x) {
    return bent.assembly.energies(bent.state.moved(bent.model, x)).total();
  };
  energy.gradient = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    const LinkageState moved = bent.state.moved(bent.model, x);
    Eigen::VectorXd gradient(x.size());
    bent.assembly.gradient(moved, gradient);
    return pulled_back(bent.model, bent.state, x, moved, gradient);
  };
  limber::testing::expect_conforms(energy, far);
}

/// The model as it is published: over vertices, directors and drawn lengths.
class WrittenDown {
 public:
  WrittenDown(const LinkageModel& model, const LinkageState& state) : model_(model), state_(state) {
    for (int s = 0; s < model.variables().segments(); ++s) {
      for (int e = 0; e < model.variables().edges(s); ++e) add_stretch(s, e);
      for (int i = 1; i < model.variables().edges(s); ++i) add_vertex(s, i);
    }
  }
  RodEnergies energies;

 private:
  [[nodiscard]] int joint_ends(int s) const {
    const auto& joints = model_.graph().segments[s].joints;
    return int(joints[0] >= 0) + int(joints[1] >= 0);
  }
  [[nodiscard]] double uniform(int s) const {
    const Segment& segment = model_.graph().segments[s];
    return (segment.points[1] - segment.points[0]).norm() /
           (model_.variables().edges(s) - 0.5 * joint_ends(s));
  }
  /// Joint at an edge that belongs to it, and the end; -1: none.
  [[nodiscard]] std::pair<int, int> owner(int s, int e) const {
    const Segment& segment = model_.graph().segments[s];
    if (e == 0 && segment.joints[0] >= 0) return {segment.joints[0], 0};
    if (e == model_.variables().edges(s) - 1 && segment.joints[1] >= 0)
      return {segment.joints[1], 1};
    return {-1, 0};
  }
  [[nodiscard]] double terminal_rest(int s, int end) const {
    const Segment& segment = model_.graph().segments[s];
    const Joint& joint = model_.graph().joints[segment.joints[end]];
    double least = 1e300;
    for (const int t : joint.segments[segment.rods[end]])
      if (t >= 0) least = std::min(least, uniform(t));
    return least;
  }
  [[nodiscard]] double rest(int s, int e) const {
    const auto [joint, end] = owner(s, e);
    if (joint >= 0) return terminal_rest(s, end);
    const Segment& segment = model_.graph().segments[s];
    double left = (segment.points[1] - segment.points[0]).norm();
    for (const int k : {0, 1})
      if (segment.joints[k] >= 0) left -= terminal_rest(s, k) / 2;
    return left / (model_.variables().edges(s) - joint_ends(s));
  }
  [[nodiscard]] Eigen::Vector3d edge(int s, int e) const {
    return state_.vertex(model_, s, e + 1) - state_.vertex(model_, s, e);
  }
  /// d2: of terminal edges the joint's normal.
  [[nodiscard]] Eigen::Vector3d d2(int s, int e) const {
    const auto [joint, end] = owner(s, e);
    if (joint >= 0) return state_.joints()[joint].normal;
    return edge(s, e).normalized().cross(state_.director(model_, s, e));
  }

  void add_stretch(int s, int e) {
    const double share = owner(s, e).first >= 0 ? 0.5 : 1;
    const double l = rest(s, e);
    energies.stretching +=
        0.5 * share * kStiffness.stretching * std::pow(edge(s, e).norm() / l - 1, 2) * l;
  }

  void add_vertex(int s, int i) {
    const Eigen::Vector3d t0 = edge(s, i - 1).normalized(), t1 = edge(s, i).normalized();
    Eigen::Vector3d curvature = 2 * t0.cross(t1) / (1 + t0.dot(t1));
    if (model_.form() == BendingForm::kTurningAngle && !curvature.isZero(0))
      curvature *= std::atan2(t0.cross(t1).norm(), t0.dot(t1)) / curvature.norm();
    const double l0 = rest(s, i - 1), l1 = rest(s, i);
    const Eigen::Vector3d a0 = d2(s, i - 1), a1 = d2(s, i);
    const Eigen::Vector3d b0 = a0.cross(t0), b1 = a1.cross(t1);
    const auto energy = [&](const Eigen::Vector3d& d2, const Eigen::Vector3d& d1) {
      return kStiffness.bending_1 * std::pow(curvature.dot(d2), 2) +
             kStiffness.bending_2 * std::pow(curvature.dot(d1), 2);
    };
    if (model_.form() != BendingForm::kAveragedFrames) {
      energies.bending += (energy(a0, b0) * l0 + energy(a1, b1) * l1) / ((l0 + l1) * (l0 + l1));
    } else {
      energies.bending += energy((a0 + a1) / 2, (b0 + b1) / 2) / (l0 + l1);
    }
    // Transport t0 to t1 by the rotation in their plane, then measure the angle to d1.
    const Eigen::Vector3d carried = reference::rotation_between(t0, t1) * b0;
    const double angle = std::atan2(t1.dot(carried.cross(b1)), carried.dot(b1));
    EXPECT_NEAR(std::remainder(state_.twist(model_, s, i) - angle, 2 * std::numbers::pi), 0, 1e-12);
    energies.twisting += kStiffness.torsion * angle * angle / (l0 + l1);
  }

  const LinkageModel& model_;
  const LinkageState& state_;
};

TEST_P(LinkageConformance, EnergyOfADeployedLinkageIsTheOneWrittenDown) {
  for (const int edges : {4, 9}) {
    BentAssembly bent(GetParam(), edges);
    std::vector<int> of_valence(5, 0);
    for (const Joint& joint : bent.model.graph().joints) ++of_valence[joint.valence];
    EXPECT_GT(of_valence[2], 0);
    EXPECT_GT(of_valence[3], 0);
    EXPECT_GT(of_valence[4], 0);
    LinkageEquilibrium equilibrium(bent.model);
    Conditions conditions;
    conditions.pins = {{4}};
    conditions.mean_opening_angle = bent.state.mean_opening_angle() + 0.4;
    LinkageState state = bent.state;
    conditions.springs = {{JointPoint{0}, {-1, 0, 1}, 3}, {JointPoint{8}, {3, 2, 1}, 3}};
    EXPECT_TRUE(equilibrium.solve(state, conditions).converged());
    Random random(6);
    for (int k = 0; k < 4; ++k) {
      const RodEnergies energies = bent.assembly.energies(state);
      const RodEnergies expected = WrittenDown(bent.model, state).energies;
      const double all = expected.total();
      EXPECT_GT(expected.twisting, 1e-5 * all);
      EXPECT_NEAR(energies.stretching, expected.stretching, 1e-12 * all);
      EXPECT_NEAR(energies.bending, expected.bending, 1e-12 * all);
      EXPECT_NEAR(energies.twisting, expected.twisting, 1e-12 * all);
      state = state.moved(bent.model,
                          random_increment(bent.model.variables().size(), 0.15 / edges, random));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllForms, LinkageConformance,
                         ::testing::Values(BendingForm::kMaterialFrames,
                                           BendingForm::kAveragedFrames,
                                           BendingForm::kTurningAngle));

}  // namespace
}  // namespace limber::rods
