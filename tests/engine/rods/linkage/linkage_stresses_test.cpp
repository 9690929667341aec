// Forces and stresses of rods against the theory of beams.
#include "engine/rods/linkage/linkage_stresses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/rods/equilibrium/linkage_equilibrium.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

constexpr double kYoung = 2e9, kPoisson = 0.3;  // Pa

/// A rod of 1 m along x with a joint at either end, where short rods cross it that carry nothing.
struct Beam {
  static constexpr int kMain = 0;  // its segment
  explicit Beam(const Section& section, double metre = 1, int edges = 20)
      : material{kYoung / (metre * metre), kPoisson},
        properties(section_properties(section)),
        model(make(properties, material, metre, edges)),
        stresses(section, properties, material, StiffAxis::kD1),
        state(model) {
    conditions.pins = {{0, Hold::kMotionAndAngle}, {1, Hold::kAngle}};
  }

  static LinkageModel make(const SectionProperties& properties, const RodMaterial& material,
                           double metre, int edges) {
    LineMesh mesh;
    mesh.vertices.resize(3, 6);
    mesh.vertices << 0, 1, 0, 0, 1, 1,  //
        0, 0, -0.2, 0.2, -0.2, 0.2,     //
        0, 0, 0, 0, 0, 0;
    mesh.vertices *= metre;
    mesh.edges.resize(2, 5);
    mesh.edges << 0, 2, 0, 4, 1,  //
        1, 0, 3, 1, 5;
    const SectionStiffness s = section_stiffness(properties, material);
    return {build_linkage_graph(mesh), edges, {s.stretching, s.bending_1, s.bending_2, s.torsion}};
  }

  /// Stations of the rod in equilibrium under a load at its far end.
  Eigen::Matrix<double, kRodFields, Eigen::Dynamic> loaded(const Eigen::Vector3d& force,
                                                           const Eigen::Vector3d& moment) {
    conditions.loads = {{1, force, moment, 0}};
    const EquilibriumReport report = LinkageEquilibrium(model).solve(state, conditions);
    EXPECT_TRUE(report.converged()) << report.message;
    const LinkageStresses result = stresses.evaluate(model, linkage_strains(model, state));
    const int first = result.first[kMain], count = result.first[kMain + 1] - first;
    return result.stations.middleCols(first, count);
  }

  RodMaterial material;
  SectionProperties properties;
  LinkageModel model;
  LinkageStressModel stresses;
  LinkageState state;
  Conditions conditions;
};

TEST(LinkageStresses, ACantileverCarriesForceTimesArm) {
  const double width = 0.03, height = 0.01, force = 0.05;
  Beam beam(Rectangle{width, height});
  const auto stations = beam.loaded({0, 0, force}, {0, 0, 0});
  const double inertia = width * std::pow(height, 3) / 12;
  const double clamp = force * 1.0;
  for (int i = 1; i < 20; ++i) {
    const double moment = force * (1 - beam.state.vertex(beam.model, Beam::kMain, i).x());
    EXPECT_NEAR(std::abs(stations(kBendingMoment2, i)), moment, 2e-3 * clamp) << i;
    EXPECT_NEAR(stations(kBendingMoment1, i), 0, 1e-6 * clamp);
    EXPECT_NEAR(stations(kLargestNormal, i), moment * height / 2 / inertia,
                2e-3 * clamp * height / 2 / inertia);
    EXPECT_NEAR(stations(kSmallestNormal, i), -moment * height / 2 / inertia,
                2e-3 * clamp * height / 2 / inertia);
    // It curves to where it is pushed.
    const Eigen::Vector3d along = beam.state.vertex(beam.model, Beam::kMain, i + 1) -
                                  beam.state.vertex(beam.model, Beam::kMain, i);
    const Eigen::Vector3d d1 = beam.state.director(beam.model, Beam::kMain, i);
    const Eigen::Vector3d d2 = along.normalized().cross(d1);
    const Eigen::Vector3d curvature = stations(kCurvature1, i) * d1 + stations(kCurvature2, i) * d2;
    EXPECT_GT(curvature.z(), 0);
  }
}

/// The largest stress is at the clamp, half an edge before the first vertex: M c / I.
TEST(LinkageStresses, AtAClampTheyAreMTimesCOverI) {
  const double width = 0.03, height = 0.01, force = 2e-3;
  const double stress = force * height / 2 / (width * std::pow(height, 3) / 12);
  for (const int edges : {3, 5, 10, 20}) {
    Beam beam(Rectangle{width, height}, 1, edges);
    const auto stations = beam.loaded({0, 0, force}, {0, 0, 0});
    EXPECT_NEAR(stations(kLargestNormal, 0), stress, 1e-3 * stress) << edges;
    EXPECT_NEAR(stations(kVonMises, 0), stress, 1e-3 * stress) << edges;
    EXPECT_LT(stations(kVonMises, edges), 1e-3 * stress) << edges;
  }
}

TEST(LinkageStresses, OfACoarseRoundRodUnderTorqueTheyAreTTimesROverJ) {
  const double diameter = 0.01, torque = 0.05;
  Beam beam(Ellipse{diameter, diameter}, 1, 3);
  const auto stations = beam.loaded({0, 0, 0}, {torque, 0, 0});
  const double inertia = std::numbers::pi * std::pow(diameter, 4) / 32;
  for (int i = 0; i <= 3; ++i)
    EXPECT_NEAR(stations(kTorsionShear, i), torque * diameter / 2 / inertia,
                1e-5 * torque * diameter / inertia);
}

/// A load at a joint makes the axial force jump there: ends have that of their own side.
TEST(LinkageStresses, AxialForcesJumpAtALoadedJoint) {
  const LinkageModel model(
      build_linkage_graph(testing::mesh_of(
          {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, -.2, 0}, {1, .2, 0}, {0, -.2, 0}, {0, .2, 0}},
          {{0, 1}, {1, 2}, {3, 1}, {1, 4}, {5, 0}, {0, 6}})),
      5, {6e5, 45, 5, 6});
  const Section section = Rectangle{0.03, 0.01};
  const LinkageStressModel stresses(section, section_properties(section), {kYoung, kPoisson},
                                    StiffAxis::kD1);
  LinkageState state(model);
  Conditions conditions;
  conditions.pins = {{0, Hold::kMotionAndAngle}};
  conditions.loads = {{1, {100, 0, 0}, {0, 0, 0}, 0}};
  ASSERT_TRUE(LinkageEquilibrium(model).solve(state, conditions).converged());
  const LinkageStresses found = stresses.evaluate(model, linkage_strains(model, state));
  for (int i = found.first[0]; i < found.first[1]; ++i)
    EXPECT_NEAR(found.stations(kAxialForce, i), 100, 1e-3) << i;
  for (int i = found.first[1]; i < found.first[2]; ++i)
    EXPECT_NEAR(found.stations(kAxialForce, i), 0, 1e-3) << i;
}

TEST(LinkageStresses, AScaledSectionIsTheLargerSection) {
  const double scale = 1.3, width = 0.03, height = 0.01;
  Beam beam(Rectangle{width, height});
  beam.model.set_section_scales(
      Eigen::VectorXd::Constant(beam.model.variables().segments(), scale));
  Beam larger(Rectangle{scale * width, scale * height});
  const Eigen::Vector3d force(3, 0.02, 0.05), moment(0.01, 0, 0);
  const auto stations = beam.loaded(force, moment);
  const auto expected = larger.loaded(force, moment);
  for (int field = 0; field < kRodFields; ++field) {
    EXPECT_LT((stations.row(field) - expected.row(field)).norm(), 1e-6 * expected.row(field).norm())
        << field;
  }
  EXPECT_GT(expected.row(kVonMises).minCoeff(), 0);
}

TEST(LinkageStresses, AMomentRollsARodToAnArc) {
  const double diameter = 0.01, angle = 0.5 * std::numbers::pi;
  Beam beam(Ellipse{diameter, diameter}, 1, 40);
  const double inertia = std::numbers::pi * std::pow(diameter, 4) / 64,
               moment = kYoung * inertia * angle;
  const auto stations = beam.loaded({0, 0, 0}, {0, -moment, 0});
  for (int i = 1; i < 40; ++i) {
    EXPECT_NEAR(std::hypot(stations(kBendingMoment1, i), stations(kBendingMoment2, i)), moment,
                1e-3 * moment);
    const double stress = moment * diameter / 2 / inertia;
    EXPECT_NEAR(stations(kLargestNormal, i), stress, 1e-3 * stress);
    EXPECT_NEAR(stations(kVonMises, i), stress, 2e-3 * stress);
    EXPECT_NEAR(stations(kTorsionShear, i), 0, 1e-4 * stress);
  }
}

TEST(LinkageStresses, ATorqueShearsAsTabulated) {
  const double torque = 0.2, side = 0.01;
  Beam round(Ellipse{side, side});
  const auto stations = round.loaded({0, 0, 0}, {torque, 0, 0});
  Beam square(Rectangle{side, side});
  const auto of_square = square.loaded({0, 0, 0}, {torque, 0, 0});
  for (int i = 0; i <= 20; ++i) {
    EXPECT_NEAR(std::abs(stations(kTorque, i)), torque, 1e-6 * torque);
    EXPECT_NEAR(stations(kTorsionShear, i), 16 * torque / (std::numbers::pi * std::pow(side, 3)),
                1e-5 * torque / std::pow(side, 3));
    // Timoshenko and Goodier, sec. 109: torque / (0.208 side^3)
    EXPECT_NEAR(of_square(kTorsionShear, i), torque / (0.208 * std::pow(side, 3)),
                2e-3 * of_square(kTorsionShear, i));
    EXPECT_NEAR(of_square(kVonMises, i), std::sqrt(3) * of_square(kTorsionShear, i),
                1e-4 * of_square(kVonMises, i));
  }
}

TEST(LinkageStresses, APullIsTheSameForceEverywhere) {
  const double force = 300;
  Beam beam(Rectangle{0.03, 0.01});
  const auto stations = beam.loaded({force, 0, 0}, {0, 0, 0});
  for (int i = 0; i <= 20; ++i) {
    EXPECT_NEAR(stations(kAxialForce, i), force, 1e-6 * force) << i;
    EXPECT_NEAR(stations(kAxialStrain, i), force / (kYoung * 3e-4), 1e-6 * force / (kYoung * 3e-4));
    EXPECT_NEAR(stations(kLargestNormal, i), 1e6, 10);
    EXPECT_NEAR(stations(kSmallestNormal, i), 1e6, 10);
  }
}

TEST(LinkageStresses, UnitsDoNotMatter) {
  const double force = 40;
  const Eigen::Vector3d push(0.2 * force, 0.3 * force, force);
  Beam in_metres(Rectangle{0.03, 0.01}), in_millimetres(Rectangle{30, 10}, 1000);
  const auto a = in_metres.loaded(push, {0.5, 0, 0}), b = in_millimetres.loaded(push, {500, 0, 0});
  const auto same = [&](RodField field, double scale) {
    const double size = a.row(field).cwiseAbs().maxCoeff();
    EXPECT_GT(size, 0);
    EXPECT_LT((a.row(field) - scale * b.row(field)).cwiseAbs().maxCoeff(), 1e-6 * size) << field;
  };
  same(kAxialForce, 1);
  same(kCurvature2, 1000);
  same(kTwistRate, 1000);
  same(kTorque, 1e-3);
  same(kBendingMoment2, 1e-3);
  for (const RodField field : {kLargestNormal, kSmallestNormal, kTorsionShear, kVonMises})
    same(field, 1e6);  // N/mm^2
}

TEST(LinkageStresses, EnergiesOfEdgesAndVerticesAreTheStates) {
  LinkageModel model(build_linkage_graph(testing::sheared_grid(3, 3, 0.8, 40)), 7, testing::kStrip,
                     BendingForm::kAveragedFrames);
  LinkageState state(model);
  Eigen::VectorXd increment(model.variables().size());
  for (Eigen::Index i = 0; i < increment.size(); ++i) increment[i] = 0.02 * std::sin(1.7 * i);
  state = state.moved(model, increment);
  const LinkageStrains strains = linkage_strains(model, state);
  const RodStiffness& k = model.stiffness();
  double stretching = 0, bending = 0, twisting = 0;
  Eigen::Index edge = 0, vertex = 0;
  for (int s = 0; s < model.variables().segments(); ++s) {
    const int edges = model.variables().edges(s);
    const auto rest = [&](int e) {
      return model.rest_lengths().edge(model.graph(), model.variables(), s, e);
    };
    for (int e = 0; e < edges; ++e, ++edge) {
      const auto& joints = model.graph().segments[s].joints;
      const bool terminal = (e == 0 && joints[0] >= 0) || (e == edges - 1 && joints[1] >= 0);
      stretching +=
          (terminal ? 0.5 : 1) * 0.5 * k.stretching * rest(e) * std::pow(strains.axial[edge], 2);
      if (e == 0) continue;
      const double length = 0.5 * (rest(e - 1) + rest(e));
      const Eigen::Vector3d turning = strains.turning.col(vertex++);
      bending += 0.5 * length *
                 (k.bending_1 * std::pow(turning[0], 2) + k.bending_2 * std::pow(turning[1], 2));
      twisting += 0.5 * length * k.torsion * std::pow(turning[2], 2);
    }
  }
  const RodEnergies wanted = LinkageAssembly(model).energies(state);
  EXPECT_NEAR(stretching, wanted.stretching, 1e-10 * wanted.stretching);
  EXPECT_NEAR(bending, wanted.bending, 1e-10 * wanted.bending);
  EXPECT_NEAR(twisting, wanted.twisting, 1e-10 * wanted.twisting);
}

TEST(LinkageStresses, CurvatureOfTurningAnglesIsTheAngleOverTheLength) {
  LineMesh line;
  line.vertices.resize(3, 2);
  line.vertices << 0, 10, 0, 0, 0, 0;
  line.edges.resize(2, 1);
  line.edges << 0, 1;
  constexpr double kTurn = 1.2;
  for (const BendingForm form : {BendingForm::kTurningAngle, BendingForm::kMaterialFrames}) {
    const LinkageModel model(build_linkage_graph(line), 2, testing::kStrip, form);
    LinkageState state(model);
    Eigen::VectorXd increment = Eigen::VectorXd::Zero(model.variables().size());
    const int last = model.variables().position(0, 2);
    increment.segment<3>(last) << 5 * (std::cos(kTurn) - 1), 5 * std::sin(kTurn), 0;
    state = state.moved(model, increment);
    const double curvature = linkage_strains(model, state).turning.col(0).head<2>().norm();
    const double angle = form == BendingForm::kTurningAngle ? kTurn : 2 * std::tan(0.5 * kTurn);
    // Frames before and after agree about an axis across both edges.
    EXPECT_NEAR(curvature, angle / 5, 1e-12);
  }
}

TEST(LinkageStresses, UnsymmetricSectionsDistinguishTheirSides) {
  // A triangle that points along d_1: its tip is twice as far from the centroid as its base.
  const Section section = Profile{{{-1, -0.1}, {2, 0}, {-1, 0.1}}, {}};
  const SectionProperties properties = section_properties(section);
  const RodMaterial material{1000, 0.25};
  LineMesh line;
  line.vertices.resize(3, 2);
  line.vertices << 0, 10, 0, 0, 0, 0;
  line.edges.resize(2, 1);
  line.edges << 0, 1;
  const SectionStiffness s = section_stiffness(properties, material);
  const LinkageModel model(build_linkage_graph(line), 2,
                           {s.stretching, s.bending_1, s.bending_2, s.torsion});
  LinkageStrains strains{Eigen::Vector2d(0.001, 0.001), Eigen::Vector3d(0.01, 0, 0)};
  const LinkageStresses stresses =
      LinkageStressModel(section, properties, material, StiffAxis::kD1).evaluate(model, strains);
  ASSERT_EQ(stresses.stations.cols(), 3);
  // Curved towards the tip: the tip is compressed.
  EXPECT_NEAR(stresses.stations(kLargestNormal, 1), 1000 * (0.001 + 0.01 * 1), 1e-9);
  EXPECT_NEAR(stresses.stations(kSmallestNormal, 1), 1000 * (0.001 - 0.01 * 2), 1e-9);
  // Free ends are pulled and not bent.
  EXPECT_NEAR(stresses.stations(kLargestNormal, 0), 1, 1e-12);
  EXPECT_EQ(stresses.stations(kBendingMoment1, 2), 0);
  strains.turning.setConstant(0.01);
  const Section angle = LSection{2, 1, 0.2};
  const LinkageStresses sharp =
      LinkageStressModel(angle, section_properties(angle), material, StiffAxis::kD1)
          .evaluate(model, strains);
  EXPECT_TRUE(std::isnan(sharp.stations(kTorsionShear, 1)));
  EXPECT_TRUE(std::isnan(sharp.stations(kVonMises, 1)));
  EXPECT_TRUE(std::isfinite(sharp.stations(kLargestNormal, 1)));
}

}  // namespace
}  // namespace limber::rods
