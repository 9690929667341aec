#include "server/kinds/bodies/scene.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>

#include <cmath>
#include <functional>

#include "server/kinds/bodies/edit.h"
#include "server/wire/scene_json.h"
#include "tests/server/support/client.h"
#include "tests/server/support/scenes.h"

namespace limber::server {
namespace {

using ::testing::HasSubstr;
using namespace limber::server::testing;

LoadedMesh no_loader(const proto::MeshSource& /*source*/, const std::string& field) {
  throw invalid(field, "no loader");
}

DecodedScene decode_without_files(const proto::Scene& scene, const SceneLimits& limits = {}) {
  const SceneReaders readers{no_loader,
                             [](const auto&, const std::string& field, int) -> Eigen::MatrixXd {
                               throw invalid(field, "no reader");
                             },
                             [](const auto&, const std::string& field) -> scene::DetailedSurface {
                               throw invalid(field, "no reader");
                             }};
  return decode_scene(scene, "scene.", limits, readers);
}

Refusal refusal_of(const std::function<void()>& decode_it) {
  try {
    decode_it();
  } catch (const Refusal& refusal) {
    return refusal;
  }
  ADD_FAILURE() << "was accepted";
  return invalid("", "");
}

proto::Vector3 vector(double x, double y, double z) {
  proto::Vector3 made;
  made.set_x(x);
  made.set_y(y);
  made.set_z(z);
  return made;
}

/// Of small_scene(): 28 nodes.
proto::Simulation full_simulation() {
  proto::Simulation simulation;
  *simulation.mutable_gravity() = vector(0, -9.81, 0);
  auto* push = simulation.add_forces();
  push->add_nodes(27);
  push->add_nodes(26);
  *push->mutable_force() = vector(1, 2, 3);
  push->set_from_frame(1.5);
  push->set_until_frame(7);
  push->set_profile(proto::FORCE_PROFILE_SINE);
  push->set_period_frames(11);
  auto* pull = simulation.add_forces();
  pull->add_nodes(20);
  *pull->mutable_force() = vector(0, 0, -1);
  pull->set_profile(proto::FORCE_PROFILE_RAMP);
  auto* initial = simulation.mutable_initial();
  for (auto* field : {initial->mutable_displacements(), initial->mutable_velocities()}) {
    field->set_type(proto::DATA_TYPE_FLOAT64);
    field->add_shape(28);
    field->add_shape(3);
    std::vector<double> numbers(84, 0.0);
    numbers.back() = field == &initial->displacements() ? 0.25 : -4;
    field->set_data(bytes_of(numbers));
  }
  initial->add_modes(0.1);
  initial->add_modes(-0.2);
  *initial->mutable_velocity() = vector(0, 1, 0);
  simulation.set_frames_per_second(60);
  simulation.set_steps_per_frame(3);
  simulation.set_scheme(proto::TIME_STEPPING_IMPLICIT_EULER);
  simulation.set_mass_damping(0.5);
  simulation.set_relaxation_time(0.01);
  return simulation;
}

proto::Scene full_scene() {
  proto::Scene scene = small_scene();
  scene.set_length_unit_in_metres(0.001);
  scene.mutable_material()->set_youngs_modulus(2e5);
  scene.mutable_material()->set_poissons_ratio(0.3);
  scene.mutable_material()->set_density(900);
  scene.set_merge_tolerance(1e-6);
  scene.set_first_end(proto::END_CONDITION_FREE);
  scene.set_last_end(proto::END_CONDITION_PINNED_POSITION);
  scene.mutable_dynamics()->set_frames_per_second(24);
  scene.mutable_dynamics()->set_period_frames(0);
  scene.mutable_dynamics()->set_damping_ratio(0.1);
  scene.mutable_dynamics()->set_discretisation(proto::TIME_DISCRETISATION_DIFFERENCES);
  scene.mutable_dynamics()->set_force_smoothing(0.2);
  scene.mutable_model()->set_tolerance(0.02);
  scene.mutable_model()->set_cubature(proto::CUBATURE_WEIGHTS);
  scene.mutable_model()->set_candidate_modes(40);
  scene.mutable_model()->set_basis(proto::BASIS_SNAPSHOTS);
  scene.mutable_material_optimisation()->set_variables(proto::MATERIAL_VARIABLES_ALL);
  scene.mutable_material_optimisation()->set_column_weight(0.5);
  scene.mutable_material_optimisation()->set_max_frequency_hz(2.5);
  scene.mutable_material_optimisation()->set_slow_steps(4);
  auto* second = scene.add_constraints();
  second->set_id(7);
  second->set_frame(3);
  second->add_nodes(5);
  second->add_nodes(6);
  second->add_axes(proto::AXIS_X);
  second->add_axes(proto::AXIS_Z);
  second->mutable_position()->set_z(-2);
  second->set_exact(true);
  auto* third = scene.add_constraints();
  third->set_id(8);
  third->set_frame(5);
  third->add_nodes(2);
  third->mutable_velocity()->set_y(1.5);
  third->set_weight(3);
  scene.mutable_constraints(0)->set_weight(40);
  *scene.mutable_simulation() = full_simulation();
  return scene;
}

TEST(SceneCodec, ComesBackAsItWas) {
  proto::Scene has_subscriber = full_scene();
  const DecodedScene decoded = decode_without_files(has_subscriber);
  has_subscriber.clear_mesh();
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(encode_scene(decoded.scene),
                                                                 has_subscriber))
      << encode_scene(decoded.scene).DebugString();
}

TEST(SceneCodec, AbsentFieldsGetTheDocumentedDefaults) {
  proto::Scene message;
  *message.mutable_mesh()->mutable_arrays() = mesh_of(make_bar(1));
  const scene::Scene scene = decode_without_files(message).scene;
  EXPECT_EQ(scene.length_unit_in_metres, 1);
  EXPECT_EQ(scene.material.youngs_modulus, 1e6);
  EXPECT_EQ(scene.material.poissons_ratio, 0.45);
  EXPECT_EQ(scene.material.density, 1000);
  EXPECT_EQ(scene.first_end, scene::End::kPinnedPositionVelocity);
  EXPECT_EQ(scene.last_end, scene::End::kPinnedPositionVelocity);
  EXPECT_EQ(scene.dynamics.frames_per_second, 30);
  EXPECT_EQ(scene.dynamics.period_frames, 40);
  EXPECT_EQ(scene.dynamics.discretisation, scene::Discretisation::kSampled);
  EXPECT_EQ(scene.dynamics.damping_ratio, scene::Dynamics::kCalmDamping);
  EXPECT_EQ(scene.dynamics.force_smoothing, scene::Dynamics::kCalmSmoothing);
  EXPECT_EQ(scene.model.mode_count, 30);
  EXPECT_EQ(scene.model.tolerance, 0.01);
  EXPECT_EQ(scene.model.cubature, scene::Cubature::kFittedMaps);
  EXPECT_FALSE(scene.merge_tolerance.has_value());
}

TEST(SceneCodec, PublishedDifferencesAreNeitherDampedNorSmoothedByDefault) {
  proto::Scene message = small_scene();
  message.mutable_dynamics()->set_discretisation(proto::TIME_DISCRETISATION_DIFFERENCES);
  const scene::Scene scene = decode_without_files(message).scene;
  EXPECT_EQ(scene.dynamics.discretisation, scene::Discretisation::kDifferences);
  EXPECT_EQ(scene.dynamics.damping_ratio, 0);
  EXPECT_EQ(scene.dynamics.force_smoothing, 0);
}

TEST(SceneCodec, ZeroGivenIsNotZeroAbsent) {
  proto::Scene message = small_scene();
  message.mutable_model()->set_modes(0);
  message.mutable_dynamics()->set_period_frames(0);
  const scene::Scene scene = decode_without_files(message).scene;
  EXPECT_EQ(scene.model.mode_count, 0);
  EXPECT_EQ(scene.dynamics.period_frames, 0);
}

TEST(SceneCodec, ConstraintDefaultsAndExactness) {
  proto::Constraint message;
  message.mutable_displacement();
  EXPECT_EQ(decode_constraint(message, "c").weight, 100);
  EXPECT_EQ(decode_constraint(message, "c").axes, 7u);
  message.set_exact(false);
  EXPECT_EQ(decode_constraint(message, "c").weight, 100);
  message.set_exact(true);
  EXPECT_TRUE(std::isinf(decode_constraint(message, "c").weight));
}

TEST(SceneCodec, PointsOfSurfacesComeBackAsTheyWent) {
  for (const auto surface : {proto::POINT_SURFACE_UNSPECIFIED, proto::POINT_SURFACE_MESH,
                             proto::POINT_SURFACE_CARRIED}) {
    proto::Constraint message;
    message.mutable_displacement()->set_x(1);
    message.set_weight(3);
    auto* const point = message.mutable_point();
    point->set_triangle(7);
    point->set_surface(surface);
    for (const double weight : {0.25, 0.5, 0.25}) point->add_weights(weight);
    const scene::Constraint decoded = decode_constraint(message, "c");
    ASSERT_TRUE(decoded.point);
    EXPECT_TRUE(decoded.nodes.empty());
    EXPECT_EQ(decoded.point->weights, Eigen::Vector3d(0.25, 0.5, 0.25));
    EXPECT_EQ(encode_constraint(decoded).SerializeAsString(), message.SerializeAsString());
  }
  proto::Constraint vertex;
  vertex.mutable_position()->set_x(1);
  vertex.set_weight(3);
  vertex.set_surface_vertex(0);
  const scene::Constraint decoded = decode_constraint(vertex, "c");
  EXPECT_EQ(decoded.surface_vertex, 0);
  EXPECT_FALSE(decoded.point);
  EXPECT_EQ(encode_constraint(decoded).SerializeAsString(), vertex.SerializeAsString());
}

TEST(SceneCodec, BadPointsAreNamed) {
  const auto fault = [](const std::function<void(proto::Constraint&)>& spoil) {
    proto::Constraint message;
    message.mutable_displacement();
    for (const double weight : {0.25, 0.5, 0.25}) message.mutable_point()->add_weights(weight);
    spoil(message);
    return refusal_of([&] { (void)decode_constraint(message, "c"); }).field();
  };
  EXPECT_EQ(fault([](auto& c) { c.mutable_point()->add_weights(0); }), "c.point.weights");
  EXPECT_EQ(fault([](auto& c) { c.mutable_point()->clear_weights(); }), "c.point.weights");
  EXPECT_EQ(fault([](auto& c) { c.mutable_point()->set_triangle(0xffffffffu); }),
            "c.point.triangle");
  EXPECT_EQ(
      fault([](auto& c) { c.mutable_point()->set_surface(static_cast<proto::PointSurface>(9)); }),
      "c.point.surface");
  EXPECT_EQ(fault([](auto& c) { c.set_surface_vertex(0xffffffffu); }), "c.surface_vertex");
}

TEST(SceneCodec, BadConstraintsAreNamed) {
  proto::Scene scene = full_scene();
  scene.mutable_constraints(1)->clear_target();
  EXPECT_EQ(refusal_of([&] { (void)decode_without_files(scene); }).field(),
            "scene.constraints[1].target");
  scene = full_scene();
  scene.mutable_constraints(1)->set_axes(1, proto::AXIS_UNSPECIFIED);
  EXPECT_EQ(refusal_of([&] { (void)decode_without_files(scene); }).field(),
            "scene.constraints[1].axes[1]");
  scene = full_scene();
  scene.mutable_constraints(1)->clear_axes();
  for (const auto axis : {proto::AXIS_Z, proto::AXIS_X, proto::AXIS_Z})
    scene.mutable_constraints(1)->add_axes(axis);
  EXPECT_EQ(refusal_of([&] { (void)decode_without_files(scene); }).field(),
            "scene.constraints[1].axes[2]");
  scene = full_scene();
  scene.mutable_constraints(1)->set_nodes(1, 0xffffffffu);
  const Refusal refusal = refusal_of([&] { (void)decode_without_files(scene); });
  EXPECT_EQ(refusal.field(), "scene.constraints[1].nodes[1]");
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_OUT_OF_RANGE);
  scene = full_scene();
  scene.set_frames(0xffffffffu);
  EXPECT_EQ(refusal_of([&] { (void)decode_without_files(scene); }).field(), "scene.frames");
}

TEST(SceneCodec, MaterialGroupsOverrideTheRest) {
  proto::Scene message = small_scene();
  auto* group = message.add_material_groups();
  group->mutable_material()->set_youngs_modulus(5);
  group->add_tets(2);
  group->add_tets(4);
  const auto mesh = decode_without_files(message).scene.mesh;
  ASSERT_EQ(mesh.tet_material.size(), 36u);
  EXPECT_EQ(mesh.materials.at(static_cast<std::size_t>(mesh.tet_material[2])).youngs_modulus, 5);
  EXPECT_EQ(mesh.materials.at(static_cast<std::size_t>(mesh.tet_material[3])).youngs_modulus, 1e6);
  message.add_material_groups()->add_tets(4);
  EXPECT_EQ(refusal_of([&] { (void)decode_without_files(message); }).field(),
            "scene.material_groups[1].tets[0]");
  message.mutable_material_groups(1)->set_tets(0, 36);
  EXPECT_EQ(refusal_of([&] { (void)decode_without_files(message); }).code(),
            proto::ERROR_CODE_OUT_OF_RANGE);
}

TEST(SceneCodec, MaterialGroupsComeBack) {
  proto::Scene message = small_scene();
  for (const std::uint32_t first : {0u, 1u}) {
    auto* group = message.add_material_groups();
    group->mutable_material()->set_youngs_modulus(5 + first);
    for (std::uint32_t tet = first; tet < 30; tet += 2) group->add_tets(tet);
  }
  const auto mesh = decode_without_files(message).scene.mesh;
  proto::Scene encoded = encode_scene(decode_without_files(message).scene);
  ASSERT_EQ(encoded.material_groups_size(), 3);  // and the tets of no group
  *encoded.mutable_mesh() = message.mesh();
  const auto again = decode_without_files(encoded).scene.mesh;
  for (std::size_t tet = 0; tet < mesh.tet_material.size(); ++tet) {
    const auto of = [&](const bodies::TetMesh& m) {
      return m.materials.at(static_cast<std::size_t>(m.tet_material[tet])).youngs_modulus;
    };
    EXPECT_EQ(of(again), of(mesh)) << tet;
  }
}

TEST(SceneCodec, PaintedNodesMakeMaterialsThatComeBack) {
  proto::Scene message = small_scene();
  EXPECT_TRUE(is_body(message));
  auto& painted = *message.mutable_painted_stiffness();
  for (int node = 0; node < 28; ++node) painted.add_values(node < 16 ? 1 : 16);
  EXPECT_TRUE(is_body(message));
  const auto mesh = decode_without_files(message).scene.mesh;
  ASSERT_EQ(mesh.tet_material.size(), 36u);
  for (int tet = 0; tet < 36; ++tet) {
    const auto stiff = (mesh.tets.col(tet).array() >= 16).count();
    // The geometric mean of 1 and 16 in 1e6 Pa.
    EXPECT_NEAR(mesh.material_of(tet).youngs_modulus / (1e6 * std::pow(2.0, stiff)), 1, 1e-12);
  }
  proto::Scene encoded = encode_scene(decode_without_files(message).scene);
  EXPECT_FALSE(encoded.has_painted_stiffness());
  *encoded.mutable_mesh() = message.mesh();
  const auto again = decode_without_files(encoded).scene.mesh;
  for (int tet = 0; tet < 36; ++tet) EXPECT_EQ(again.material_of(tet), mesh.material_of(tet));

  painted.set_quantity(proto::PAINTED_QUANTITY_YOUNGS_MODULUS);
  for (double& value : *painted.mutable_values()) value *= 1e5;
  EXPECT_NEAR(decode_without_files(message).scene.mesh.material_of(0).youngs_modulus, 1e5, 1e-7);
}

TEST(SceneCodec, FaultsOfPaintedStiffnessAreNamed) {
  proto::Scene message = small_scene();
  auto& painted = *message.mutable_painted_stiffness();
  const auto field = [&] {
    try {
      (void)decode_without_files(message);
    } catch (const Error& error) {
      return error.field();
    } catch (const Refusal& refusal) {
      return refusal.field();
    }
    return std::string("nothing");
  };
  painted.add_values(2);
  EXPECT_EQ(field(), "scene.painted_stiffness.values");
  for (int node = 1; node < 28; ++node) painted.add_values(node == 5 ? -1 : 2);
  EXPECT_EQ(field(), "scene.painted_stiffness.values[5]");
  painted.set_points(proto::PAINTED_POINTS_SURFACE);
  EXPECT_EQ(field(), "scene.painted_stiffness.points");
  painted.set_points(proto::PAINTED_POINTS_NODES);
  painted.mutable_file()->set_name("a.txt");
  EXPECT_EQ(field(), "scene.painted_stiffness.values");
  painted.clear_values();
  painted.mutable_file()->set_content("1 2 3");
  EXPECT_EQ(field(), "scene.painted_stiffness.file");
}

TEST(SceneCodec, BaseMotionComesBack) {
  proto::Scene message = small_scene(2, 3);
  auto decoded = decode_without_files(message).scene;
  decoded.base_motion = Eigen::MatrixXd::Random(3 * decoded.mesh.node_count(), 3);
  *message.mutable_base_motion() = encode_base_motion(decoded);
  const Eigen::MatrixXd again = decode_without_files(message).scene.base_motion;
  ASSERT_EQ(again.cols(), 3);
  EXPECT_LT((again - decoded.base_motion).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(SceneCodec, LimitsAreNamedWithTheirValues) {
  const proto::Scene scene = full_scene();
  EXPECT_NO_THROW((void)decode_without_files(scene, {36, 20, 3}));
  Refusal refusal = refusal_of([&] { (void)decode_without_files(scene, {35, 20, 3}); });
  EXPECT_EQ(refusal.code(), proto::ERROR_CODE_LIMIT_EXCEEDED);
  EXPECT_EQ(refusal.details().at("limit"), "35");
  EXPECT_EQ(refusal.details().at("value"), "36");
  EXPECT_EQ(refusal_of([&] {
              (void)decode_without_files(scene, {36, 19, 3});
            }).field(),
            "scene.frames");
  EXPECT_EQ(refusal_of([&] {
              (void)decode_without_files(scene, {36, 20, 2});
            }).field(),
            "scene.constraints");
}

TEST(SceneCodec, BaseMotionsBecomeDisplacements) {
  proto::Scene scene = small_scene(1, 3);
  const Bar bar = make_bar(1);
  std::vector<double> motion;
  for (int frame = 0; frame < 3; ++frame) {
    for (std::size_t i = 0; i < bar.nodes.size(); ++i)
      motion.push_back(bar.nodes[i] + frame * (i % 3 == 1 ? 0.5 : 0.0));
  }
  auto* array = scene.mutable_base_motion()->mutable_positions();
  array->set_type(proto::DATA_TYPE_FLOAT64);
  for (const std::uint64_t extent : {3ull, 8ull, 3ull}) array->add_shape(extent);
  array->set_data(bytes_of(motion));
  const Eigen::MatrixXd base = decode_without_files(scene).scene.base_motion;
  ASSERT_EQ(base.rows(), 24);
  EXPECT_DOUBLE_EQ(base(3 * 5 + 1, 2), 1.0);
  EXPECT_DOUBLE_EQ(base(3 * 5, 2), 0.0);
  array->set_shape(1, 9);
  EXPECT_EQ(refusal_of([&] { (void)decode_without_files(scene); }).field(),
            "scene.base_motion.positions.data");
}

TEST(SceneCodec, PointCachesAloneAreMovedToWhereTheBodyIs) {
  proto::Scene scene = small_scene(1, 3);
  Bar bar = make_bar(1);
  const std::vector<double> near = bar.nodes;
  for (double& coordinate : bar.nodes) coordinate += 1e6;
  *scene.mutable_mesh()->mutable_arrays() = mesh_of(bar);
  // The first frame truly is at the origin.
  std::vector<double> motion;
  for (int frame = 0; frame < 3; ++frame) motion.insert(motion.end(), near.begin(), near.end());
  auto* array = scene.mutable_base_motion()->mutable_positions();
  array->set_type(proto::DATA_TYPE_FLOAT64);
  for (const std::uint64_t extent : {3ull, 8ull, 3ull}) array->add_shape(extent);
  array->set_data(bytes_of(motion));
  EXPECT_EQ(decode_without_files(scene).scene.base_motion(0, 0), -1e6);

  const SceneReaders readers{
      no_loader,
      [&](const auto&, const std::string&, int) -> Eigen::MatrixXd {
        return Eigen::Map<const Eigen::VectorXd>(near.data(), 24).replicate(1, 3);
      },
      {}};
  const auto first_of = [&](const char* path) {
    scene.mutable_base_motion()->set_path(path);
    return decode_scene(scene, "scene.", {}, readers).scene.base_motion(0, 0);
  };
  EXPECT_EQ(first_of("m.pvd"), -1e6);
  EXPECT_NEAR(first_of("m.PC2"), 0, 1) << "the cache is relative to the body's middle";
}

TEST(SceneCodec, AMeshIsNeeded) {
  EXPECT_EQ(refusal_of([] { (void)decode_without_files(proto::Scene()); }).field(), "scene.mesh");
}

TEST(EditCodec, EveryKindOfEdit) {
  proto::EditRequest request;
  request.add_edits()->mutable_add()->mutable_constraint()->mutable_position()->set_x(1);
  auto* move = request.add_edits()->mutable_move();
  move->set_id(3);
  move->mutable_target()->set_z(2);
  request.add_edits()->mutable_replace()->mutable_constraint()->mutable_displacement();
  request.add_edits()->mutable_remove()->set_id(4);
  auto* ends = request.add_edits()->mutable_set_ends();
  ends->set_first_end(proto::END_CONDITION_FREE);
  ends->set_last_end(proto::END_CONDITION_PINNED_POSITION_VELOCITY);
  request.add_edits()->mutable_set_dynamics()->set_damping_ratio(0.5);
  request.add_edits()->mutable_undo();
  request.add_edits()->mutable_redo();
  const auto edits = decode_edits(request, {}, no_loader);
  ASSERT_EQ(edits.size(), 8u);
  EXPECT_EQ(std::get<session::AddConstraint>(edits[0]).constraint.kind,
            scene::TargetKind::kPosition);
  EXPECT_EQ(std::get<session::MoveConstraint>(edits[1]).target.z(), 2);
  EXPECT_EQ(std::get<session::RemoveConstraint>(edits[3]).id, 4u);
  EXPECT_EQ(std::get<session::SetEnds>(edits[4]).first, scene::End::kFree);
  EXPECT_EQ(std::get<session::SetEnds>(edits[4]).last, scene::End::kPinnedPositionVelocity);
  EXPECT_EQ(std::get<session::SetDynamics>(edits[5]).dynamics.damping_ratio, 0.5);
  EXPECT_TRUE(std::holds_alternative<session::Undo>(edits[6]));
  EXPECT_TRUE(std::holds_alternative<session::Redo>(edits[7]));
}

TEST(EditCodec, WhatIsMissingIsNamed) {
  const auto field = [](const proto::EditRequest& request) {
    return refusal_of([&] { (void)decode_edits(request, {}, no_loader); }).field();
  };
  proto::EditRequest request;
  EXPECT_EQ(field(request), "edits");
  request.add_edits();
  EXPECT_EQ(field(request), "edits[0]");
  request.mutable_edits(0)->mutable_add();
  EXPECT_EQ(field(request), "edits[0].add.constraint");
  request.mutable_edits(0)->mutable_move();
  EXPECT_EQ(field(request), "edits[0].move.target");
  request.mutable_edits(0)->mutable_replace()->mutable_constraint();
  EXPECT_EQ(field(request), "edits[0].replace.constraint.target");
  request.mutable_edits(0)->mutable_set_ends()->set_last_end(proto::END_CONDITION_FREE);
  EXPECT_EQ(field(request), "edits[0].set_ends.first_end");
  request.mutable_edits(0)->mutable_set_ends()->set_first_end(proto::END_CONDITION_FREE);
  request.mutable_edits(0)->mutable_set_ends()->clear_last_end();
  EXPECT_EQ(field(request), "edits[0].set_ends.last_end");
}

TEST(SceneJson, ComesBackAsItWas) {
  const proto::Scene scene = full_scene();
  EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(
      scene_from_json(scene_to_json(scene)), scene));
  EXPECT_THAT(scene_to_json(scene), HasSubstr("\"fixed_nodes\""));
}

TEST(SceneJson, FaultsAreRefused) {
  EXPECT_THROW((void)scene_from_json("{"), Refusal);
  EXPECT_THROW((void)scene_from_json("[]"), Refusal);
  EXPECT_EQ(refusal_of([] { (void)scene_from_json(R"({"frame_count": 3})"); }).field(),
            "frame_count");
  EXPECT_EQ(refusal_of([] { (void)scene_from_json(R"({"frames": 3, "frames": 3})"); }).field(),
            "frames");
  EXPECT_THROW((void)scene_from_json(R"({"frames": -1})"), Refusal);
  EXPECT_THROW((void)scene_from_json(R"({"first_end": "LOOSE"})"), Refusal);
  EXPECT_EQ(
      refusal_of([] { (void)scene_from_json(R"({"length_unit_in_metres": "NaN"})"); }).field(),
      "length_unit_in_metres");
}

}  // namespace
}  // namespace limber::server
