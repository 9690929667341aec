#include "engine/session/bodies/problem_mapping.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/LU>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/session/bodies/geometry.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

using scene::TargetKind;

/// two_tets() with node 1 doubled: the second tet hangs on the copy, node 6.
scene::Scene split() {
  scene::Scene scene = test::two_tets();
  scene.mesh.nodes.conservativeResize(3, 7);
  scene.mesh.nodes.col(6) = scene.mesh.nodes.col(1) + Eigen::Vector3d(1e-9, 0, 0);
  scene.mesh.tets(2, 1) = 6;
  scene.merge_tolerance = 1e-6;
  scene.fixed_nodes = {2, 0};
  return scene;
}

TEST(ProblemMapping, BodyIsCompactAndInMetres) {
  scene::Scene scene = split();
  scene.length_unit_in_metres = 0.001;
  const MappedBody mapped = map_body(scene);
  EXPECT_EQ(mapped.body.mesh.node_count(), 5);
  EXPECT_THAT(mapped.compact_of_source, ::testing::ElementsAre(0, 1, 2, 3, 4, -1, 1));
  EXPECT_THAT(mapped.body.fixed_nodes, ::testing::ElementsAre(0, 2));
  EXPECT_EQ(mapped.body.mesh.nodes.col(1), Eigen::Vector3d(0.001, 0, 0));
  EXPECT_THAT(mapped.repairs, ::testing::Not(::testing::IsEmpty()));
  ASSERT_EQ(mapped.body.mesh.tet_material.size(), 2u);
  EXPECT_EQ(mapped.body.mesh.materials.at(0), scene.material);
}

TEST(ProblemMapping, WhatAModelHasOtherwiseThanRequestedIsNoted) {
  reduced::ReducedModel model;
  model.eigenvalues.setZero(36);
  model.basis.setZero(12, 511);
  model.tets.assign(40, 0);
  scene::ModelRequest request;
  request.mode_count = 36;
  EXPECT_EQ(model_notes(request, model), "") << "sizes that were left to the builder";
  request.basis_size = 511;
  request.cubature_size = 40;
  EXPECT_EQ(model_notes(request, model), "");
  request.mode_count = 30;
  model.rigid_count = 6;
  request.basis_size = 5000;
  request.cubature_size = 41;
  const std::string notes = model_notes(request, model);
  EXPECT_THAT(notes, ::testing::HasSubstr("model.modes: 36 used, the 30 requested and 6 rigid"));
  EXPECT_THAT(notes, ::testing::HasSubstr("; model.basis_size: 511 used, 5000 requested"));
  EXPECT_THAT(notes, ::testing::HasSubstr("; model.cubature_size: 40 used, 41 requested"));
  request = {};
  model.eigenvalues.setZero(35);
  EXPECT_EQ(model_notes(request, model),
            "model.modes: 29 used, 30 requested: the mesh has no more");
}

TEST(ProblemMapping, TheMeshsOwnMaterialsWin) {
  scene::Scene scene = test::two_tets();
  scene.mesh.materials = {{1e5, 0.3, 900}, {2e5, 0.2, 800}};
  scene.mesh.tet_material = {1, 0};
  const MappedBody mapped = map_body(scene);
  EXPECT_EQ(mapped.body.mesh.materials.at(mapped.body.mesh.tet_material.at(0)).youngs_modulus, 2e5);
  EXPECT_EQ(mapped.body.mesh.materials.at(mapped.body.mesh.tet_material.at(1)).youngs_modulus, 1e5);
}

TEST(ProblemMapping, LengthsInMillimetresAreThoseInMetresToTheBit) {
  const LengthUnit millimetre(0.001), inch(0.0254), kilometre(1000), metre(1);
  for (int i = 1; i < 2000; ++i) EXPECT_EQ(millimetre.to_si(i * 1.0), i / 1000.0);
  EXPECT_EQ(millimetre.to_scene(0.25), 250);
  EXPECT_DOUBLE_EQ(inch.to_si(10.0), 0.254);
  EXPECT_EQ(kilometre.to_si(2.0), 2000);
  EXPECT_EQ(metre.to_si(0.1), 0.1);
  EXPECT_EQ(metre.to_scene(0.1), 0.1);
}

scene::Dynamics published(double frames_per_second, double period, double damping) {
  return {frames_per_second, period, damping, scene::Discretisation::kDifferences, 0};
}

TEST(ProblemMapping, DynamicsFromThePeriod) {
  Eigen::VectorXd eigenvalues(4);
  eigenvalues << 0, 100, 400, 2500;
  const auto mapped = map_dynamics(published(30, 40, 0.1), eigenvalues, 1);
  const double lowest = std::pow(2 * std::numbers::pi / 40, 2);
  EXPECT_EQ(mapped.stiffness[0], 0);
  EXPECT_EQ(mapped.damping[0], 0);
  EXPECT_NEAR(mapped.stiffness[1], lowest, 1e-15);
  EXPECT_NEAR(mapped.stiffness[2], 4 * lowest, 1e-14);
  EXPECT_NEAR(mapped.stiffness[3], 25 * lowest, 1e-13);
  EXPECT_NEAR(mapped.damping[3], 2 * 0.1 * 5 * std::sqrt(lowest), 1e-14);
}

// The period is that of the first mode that something holds.
TEST(ProblemMapping, DynamicsFromThePeriodOfABodyThatFolds) {
  Eigen::VectorXd eigenvalues(4);
  eigenvalues << 0, 0.01, 100, 400;
  const auto mapped = map_dynamics(published(30, 40, 0.1), eigenvalues, 1, 1);
  const double lowest = std::pow(2 * std::numbers::pi / 40, 2);
  EXPECT_EQ(mapped.stiffness[0], 0);
  EXPECT_NEAR(mapped.stiffness[1], 1e-4 * lowest, 1e-18);
  EXPECT_NEAR(mapped.stiffness[2], lowest, 1e-15);
  EXPECT_NEAR(mapped.stiffness[3], 4 * lowest, 1e-14);
  const auto nothing_else = map_dynamics(published(30, 40, 0.1), Eigen::Vector2d(0.01, 0.01), 0, 2);
  EXPECT_NEAR(nothing_else.stiffness[0], lowest, 1e-15);
}

TEST(ProblemMapping, DynamicsFromTheMaterials) {
  const Eigen::Vector2d eigenvalues(90, 360);
  const auto mapped = map_dynamics(published(30, 0, 0.5), eigenvalues, 0);
  EXPECT_NEAR(mapped.stiffness[0], 0.1, 1e-15);
  EXPECT_NEAR(mapped.stiffness[1], 0.4, 1e-15);
  EXPECT_NEAR(mapped.damping[1], std::sqrt(0.4), 1e-15);
}

TEST(ProblemMapping, SampledModesAreDampedInProportionToTheirFrequency) {
  const Eigen::Vector3d eigenvalues(0, 90, 360);
  const auto mapped =
      map_dynamics({30, 40, 0.2, scene::Discretisation::kSampled, 0.5}, eigenvalues, 1);
  EXPECT_EQ(mapped.discretisation, spacetime::Discretisation::kSampled);
  EXPECT_EQ(mapped.damping[0], 0);
  EXPECT_NEAR(mapped.damping[1] / (2 * std::sqrt(mapped.stiffness[1])), 0.2, 1e-15);
  EXPECT_NEAR(mapped.damping[2] / (2 * std::sqrt(mapped.stiffness[2])), 0.4, 1e-15);
  EXPECT_EQ(mapped.smoothing, 15);
}

// Of a motion in seconds, whatever its frames: an acceleration for a second.
TEST(ProblemMapping, WhatForcesCostDoesNotDependOnTheFrameRate) {
  const Eigen::VectorXd eigenvalues = Eigen::VectorXd::Constant(1, 90);
  for (const double period : {0.0, 0.5, 2.0}) {  // [s]
    std::vector<double> costs;
    for (const double rate : {12.0, 24.0, 48.0}) {
      const auto mapped = map_dynamics(
          {rate, period * rate, 0.2, scene::Discretisation::kSampled, 0}, eigenvalues, 0);
      costs.push_back(mapped.scale * rate * std::pow(rate, -4));
    }
    EXPECT_NEAR(costs[1], costs[0], 1e-12 * costs[0]) << period;
    EXPECT_NEAR(costs[2], costs[0], 1e-12 * costs[0]) << period;
  }
}

TEST(ProblemMapping, ModelRequest) {
  scene::Scene scene;
  scene::ModelRequest& request = scene.model;
  request.mode_count = 7;
  request.tolerance = 0.03;
  request.basis_size = 40;
  request.cubature_size = 11;
  request.cubature = scene::Cubature::kWeights;
  bodies::ElasticBody body;
  body.mesh.nodes.setZero(3, 100);
  body.fixed_nodes = {0, 1, 2};
  const reduced::ModelOptions options = map_model(scene, body);
  EXPECT_EQ(options.mode_count, 7);
  EXPECT_EQ(options.tolerance, 0.03);
  EXPECT_EQ(options.basis_size, 40);
  EXPECT_EQ(options.cubature_size, 11);
  EXPECT_EQ(options.cubature, reduced::CubatureKind::kWeights);
}

TEST(ProblemMapping, CandidatesForMixedModesAreAsManyAsTheMeshHas) {
  scene::Scene scene;
  scene.model.mode_count = 7;
  bodies::ElasticBody body;
  body.mesh.nodes.setZero(3, 100);
  body.fixed_nodes = {0, 1, 2};
  scene.material_optimisation.variables = scene::MaterialVariables::kAll;
  EXPECT_EQ(map_model(scene, body).mode_count, 80);
  scene.model.candidate_modes = 12;
  EXPECT_EQ(map_model(scene, body).mode_count, 12);
  scene.model.candidate_modes = 0;
  scene.model.mode_count = 100;
  EXPECT_EQ(map_model(scene, body).mode_count, 100);
  scene.model.mode_count = 7;
  body.mesh.nodes.setZero(3, 10);
  EXPECT_EQ(map_model(scene, body).mode_count, 20);
  scene.material_optimisation.variables = scene::MaterialVariables::kDynamics;
  EXPECT_EQ(map_model(scene, body).mode_count, 7);
}

TEST(ProblemMapping, TargetsOfGroups) {
  scene::Scene scene = split();
  scene.length_unit_in_metres = 0.01;
  const MappedBody mapped = map_body(scene);
  const TargetFrame targets(scene, mapped);
  // A merged node counts once, however often its copies are named.
  scene::Constraint named;
  named.nodes = {6, 3, 1};
  const reduced::Site group = targets.site(named);
  EXPECT_THAT(group.nodes, ::testing::ElementsAre(1, 3));
  EXPECT_TRUE(group.weights.empty());
  EXPECT_EQ(targets.origin(TargetKind::kDisplacement, group), Eigen::Vector3d::Zero());
  const Eigen::Vector3d origin = targets.origin(TargetKind::kPosition, group);
  EXPECT_EQ(origin, Eigen::Vector3d(0.5, 0, 0.5));
  EXPECT_LT((targets.displacement({1, 2, 3}, origin) - Eigen::Vector3d(0.005, 0.02, 0.025)).norm(),
            1e-17);
}

TEST(ProblemMapping, BaseMotionLosesUnusedNodes) {
  scene::Scene scene = split();
  scene.length_unit_in_metres = 0.001;
  scene.base_motion = Eigen::VectorXd::LinSpaced(21, 0, 20) * Eigen::RowVector2d(1, 10);
  const Eigen::MatrixXd motion = map_base_motion(scene, map_body(scene).source_of_compact);
  ASSERT_EQ(motion.rows(), 15);
  EXPECT_EQ(motion(14, 1), 0.14);  // node 4, z
}

TEST(SessionGeometry, UnusedNodesRestAndMergedOnesMoveTogether) {
  scene::Scene scene = split();
  scene.length_unit_in_metres = 0.001;
  std::swap(scene.mesh.tets(0, 0), scene.mesh.tets(1, 0));  // the client's first tet is inside out
  const MappedBody mapped = map_body(scene);
  reduced::ReducedModel model;
  model.node_count = 5;
  Random random(3);
  model.basis = Eigen::MatrixXd::NullaryExpr(15, 4, [&] { return random.uniform(-1, 1); });
  const Geometry geometry = make_geometry(scene, mapped, model);
  EXPECT_EQ(geometry.rest, scene.mesh.nodes);
  EXPECT_EQ(geometry.tets, scene.mesh.tets);
  ASSERT_EQ(geometry.basis.rows(), 21);
  EXPECT_TRUE(geometry.basis.middleRows(15, 3).isZero(0));
  EXPECT_EQ(geometry.basis.middleRows(3, 3), geometry.basis.middleRows(18, 3));
  EXPECT_LT((geometry.basis.topRows(15) - (1000 * model.basis).cast<float>()).cwiseAbs().maxCoeff(),
            1e-4);

  // Two tets that share a face have six boundary faces; their outward normals integrate to the
  // volume.
  ASSERT_EQ(geometry.surface.cols(), 6);
  double volume = 0;
  for (int t = 0; t < 6; ++t) {
    Eigen::Matrix3d corners;
    for (int c = 0; c < 3; ++c) corners.col(c) = scene.mesh.nodes.col(geometry.surface(c, t));
    volume += corners.determinant() / 6;
  }
  EXPECT_NEAR(volume, 2.0 / 6, 1e-8);

  EXPECT_EQ(geometry.basis_hash, make_geometry(scene, mapped, model).basis_hash);
  const Eigen::MatrixXf q =
      Eigen::MatrixXf::NullaryExpr(4, 3, [&] { return static_cast<float>(random.uniform(-1, 1)); });
  const Eigen::MatrixXd positions =
      positions_of(geometry, LengthUnit(0.001), mapped.compact_of_source, model.basis, q);
  EXPECT_EQ(positions.middleRows(15, 3), scene.mesh.nodes.col(5).replicate(1, 3));
  const Eigen::MatrixXf streamed = geometry.basis * q;
  for (int frame = 0; frame < 3; ++frame) {
    const Eigen::VectorXd moved =
        positions.col(frame) - Eigen::Map<const Eigen::VectorXd>(scene.mesh.nodes.data(), 21);
    EXPECT_LT((moved - streamed.col(frame).cast<double>()).cwiseAbs().maxCoeff(), 1e-2) << frame;
  }
  model.basis(14, 3) += 1e-3;
  EXPECT_NE(geometry.basis_hash, make_geometry(scene, mapped, model).basis_hash);
}

}  // namespace
}  // namespace limber::session
