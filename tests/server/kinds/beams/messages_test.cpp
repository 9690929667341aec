// Structures of beams and their edits between messages and values.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/beams/structure/beam_structure.h"
#include "engine/session/beams/live_problem.h"
#include "proto/json_text.h"
#include "server/kinds/beams/edit.h"
#include "server/kinds/beams/memory_estimate.h"
#include "server/kinds/beams/result.h"
#include "server/kinds/beams/scene.h"
#include "server/kinds/beams/scenes.h"
#include "server/kinds/beams/solution.h"
#include "server/wire/arrays.h"
#include "server/wire/fields.h"
#include "tests/server/wire/refused_field.h"

namespace limber::server {
namespace {

using testing::refused_field;

constexpr const char* kStructure = R"({
  "name": "portal",
  "nodes": [{"position": {}}, {"position": {"x": 1}, "normal": {"y": 1}}, {"position": {"x": 1, "z": 2}}],
  "sections": [{"tube": {"outer_radius": 0.02, "inner_radius": 0.01}, "young": 2e11, "poisson": 0.3, "density": 7800}],
  "elements": [{"start": 0, "finish": 1, "start_release": {"rotations": [2]}, "rest_length": 1.01},
               {"start": 1, "finish": 2, "kind": "BEAM_KIND_CABLE"}],
  "supports": [{"node": 0, "fix_x": true, "fix_y": true, "fix_z": true, "fix_rotation_x": true},
               {"node": 2, "fix_x": true, "x_axis": {"x": 1, "y": 1}, "y_axis": {"x": -3}}],
  "motions": [{"node": 1, "y": 0, "z": 0.1, "rotation": {"x": 0.2}}],
  "loads": [{"node": 1, "force": {"z": -5}, "moment": {"y": 1}, "follows": true}],
  "distributed_loads": [{"element": 0, "force": {"z": -2}}],
  "gravity": {"z": -9.81},
  "temporary_loads": [{"node": 1, "force": {"y": 1}}]
})";

proto::Scene scene() {
  proto::Scene message;
  EXPECT_FALSE(json::read_message(kStructure, *message.mutable_beams()->mutable_structure()));
  return message;
}

DecodedBeams decode_structure(const proto::Scene& message) {
  return decode_beam_scene(message, "scene.", [](const proto::LineSource&, const std::string&) {
    return scene::EdgeMesh();
  });
}

TEST(BeamCodec, ScenesComeBackAsTheyWent) {
  proto::Scene sent = scene();
  auto& slope = *sent.mutable_beams()->mutable_structure()->mutable_supports(1);
  slope.mutable_x_axis()->set_x(0);  // axes that nothing rounds
  const DecodedBeams first = decode_structure(sent);
  EXPECT_EQ(first.name, "portal");
  const beams::BeamModel& model = first.model;
  EXPECT_EQ(model.elements[0].start_release.rotations, (std::array<bool, 3>{false, true, false}));
  EXPECT_EQ(model.elements[1].kind, beams::BeamKind::kCable);
  EXPECT_EQ(model.motions[0].translates, (std::array<bool, 3>{false, true, true}));
  EXPECT_EQ(model.loads[0].direction, beams::LoadDirection::kFollowing);
  const proto::Scene scene_message = encode_beam_scene(first);
  const DecodedBeams second = decode_structure(scene_message);
  EXPECT_EQ(scene_message.SerializeAsString(), encode_beam_scene(second).SerializeAsString());
  EXPECT_EQ(second.model.supports[1].fixed, model.supports[1].fixed);
  EXPECT_EQ(second.model.sections[0].bending_2, model.sections[0].bending_2);
}

TEST(BeamCodec, ShearModuliAreTakenAndComeBack) {
  proto::Scene sent = scene();
  auto& section = *sent.mutable_beams()->mutable_structure()->mutable_sections(0);
  EXPECT_NEAR(decode_structure(sent).model.sections[0].shear, 2e11 / 2.6, 1);
  section.set_shear_modulus(7e10);
  EXPECT_EQ(refused_field([&] { (void)decode_structure(sent); }),
            "scene.beams.structure.sections[0].poisson");
  section.clear_poisson();
  const DecodedBeams decoded = decode_structure(sent);
  EXPECT_EQ(decoded.model.sections[0].shear, 7e10);
  EXPECT_EQ(encode_beam_scene(decoded).beams().structure().sections(0).shear_modulus(), 7e10);
  section.set_shear_modulus(-1);
  EXPECT_EQ(refused_field([&] { (void)decode_structure(sent); }),
            "scene.beams.structure.sections[0].shear_modulus");
}

TEST(BeamCodec, DiscretisationsComeBackAndAreChecked) {
  proto::Scene sent = scene();
  EXPECT_FALSE(decode_structure(sent).discretisation.elements_per_member);
  EXPECT_FALSE(encode_beam_scene(decode_structure(sent)).beams().has_tolerance());
  sent.mutable_beams()->set_elements_per_member(4);
  sent.mutable_beams()->set_tolerance(0.001);
  const DecodedBeams decoded = decode_structure(sent);
  EXPECT_EQ(decoded.discretisation.elements_per_member, 4);
  EXPECT_EQ(decoded.discretisation.tolerance, 0.001);
  const proto::Scene back = encode_beam_scene(decoded);
  EXPECT_EQ(back.beams().elements_per_member(), 4U);
  EXPECT_EQ(back.beams().tolerance(), 0.001);
  sent.mutable_beams()->set_elements_per_member(4000000000U);
  EXPECT_EQ(refused_field([&] { (void)decode_structure(sent); }),
            "scene.beams.elements_per_member");
  sent.mutable_beams()->clear_elements_per_member();
  sent.mutable_beams()->set_tolerance(-1);
  EXPECT_EQ(refused_field([&] { (void)decode_structure(sent); }), "scene.beams.tolerance");
}

TEST(BeamMemory, LimitsTheElementsThatAToleranceMayTake) {
  DecodedBeams decoded = decode_structure(scene());
  decoded.discretisation.tolerance = 1e-3;
  EXPECT_EQ(demand_beam_memory(decoded, 0).max_elements, beams::kMaxCutElements);
  const int few = demand_beam_memory(decoded, 2'000'000).max_elements;
  EXPECT_LT(few, beams::kMaxCutElements / 10);
  EXPECT_GE(few, 2);
  decoded.discretisation.elements_per_member = 64;
  EXPECT_THROW((void)demand_beam_memory(decoded, 100'000), Refusal);
}

/// As a session keeps them.
TEST(BeamMemory, CountsShapesAsDoubles) {
  const beams::BeamModel model = decode_structure(scene()).model;
  const auto shape = session::beam_coordinates(beams::BeamStructure(model).rest_state());
  const std::uint64_t shapes = estimate_beam_bytes(model, 100) - estimate_beam_bytes(model, 0);
  EXPECT_GE(shapes + 1, 100 * static_cast<std::uint64_t>(shape.size()) * sizeof(double));
}

TEST(BeamCodec, ResultsHaveTheirDiscretisationError) {
  session::BeamResult result;
  result.is_final = true;
  result.frames = std::make_shared<Eigen::MatrixXd>(7, 1);
  beams::BeamModel model = decode_structure(scene()).model;
  beams::BeamStructure structure(model);
  beams::BeamSolution solution{structure.rest_state(), {}};
  beams::BeamResults results = results_of(structure, solution.state);
  result.analysis = std::make_shared<const session::BeamAnalysis>(
      session::BeamAnalysis{std::move(structure), std::move(solution), std::move(results), {}});
  EXPECT_FALSE(encode_beam_result(result).has_discretisation_error());
  session::DiscretisationCheck check;
  check.error = {.is_known = true,
                 .position_error = 0.01,
                 .max_distance = 0.5,
                 .worst_node = 2,
                 .energy_error = 0.03,
                 .moment_error = 0.015,
                 .max_moment_error = 70,
                 .worst_moment_element = 1,
                 .utilisation_error = 0.017,
                 .worst_utilisation_element = 3,
                 .elements = 10,
                 .compared_elements = 40,
                 .order = 4,
                 .message = ""};
  check.tolerance = 0.02;
  check.check_ms = 7;
  result.discretisation = std::make_shared<const session::DiscretisationCheck>(check);
  const proto::DiscretisationError message = encode_beam_result(result).discretisation_error();
  EXPECT_EQ(message.position_error(), 0.01);
  EXPECT_EQ(message.max_distance(), 0.5);
  EXPECT_EQ(message.worst_node(), 2U);
  EXPECT_EQ(message.energy_error(), 0.03);
  EXPECT_EQ(message.utilisation_error(), 0.017);
  EXPECT_EQ(message.worst_utilisation_element(), 3U);
  EXPECT_EQ(message.elements(), 10U);
  EXPECT_EQ(message.compared_elements(), 40U);
  EXPECT_EQ(message.tolerance(), 0.02);
  EXPECT_TRUE(message.within_tolerance());
  EXPECT_EQ(message.check_ms(), 7);
  EXPECT_EQ(message.moment_error(), 0.015);
  EXPECT_EQ(message.max_moment_error(), 70);
  EXPECT_EQ(message.worst_moment_element(), 1U);
  check.error.utilisation_error.reset();  // no yield stress is known
  result.discretisation = std::make_shared<const session::DiscretisationCheck>(check);
  EXPECT_FALSE(encode_beam_result(result).discretisation_error().has_utilisation_error());
  check.error.utilisation_error = 0.025;  // the tolerance is 0.02
  check.error.worst_utilisation_element = 1;
  result.discretisation = std::make_shared<const session::DiscretisationCheck>(check);
  const proto::DiscretisationError missed = encode_beam_result(result).discretisation_error();
  EXPECT_EQ(missed.utilisation_error(), 0.025);
  EXPECT_EQ(missed.worst_utilisation_element(), 1U);
  EXPECT_FALSE(missed.within_tolerance());
  // That of the whole is not known beside a cable that sags, those of the beams are.
  check.error.is_known = false;
  check.error.message = "a cable sags";
  result.discretisation = std::make_shared<const session::DiscretisationCheck>(check);
  const proto::DiscretisationError beside = encode_beam_result(result).discretisation_error();
  EXPECT_EQ(beside.compared_elements(), 0U);
  EXPECT_FALSE(beside.within_tolerance());
  EXPECT_EQ(beside.message(), "a cable sags");
  EXPECT_FALSE(beside.has_position_error()) << "the cable's own sag moves nodes";
  EXPECT_EQ(beside.moment_error(), 0.015);
  EXPECT_EQ(beside.utilisation_error(), 0.025);
  // What is unknown is no error of 0.
  check.error = {};
  check.error.message = "no equilibrium was found";
  result.discretisation = std::make_shared<const session::DiscretisationCheck>(check);
  const proto::DiscretisationError unknown = encode_beam_result(result).discretisation_error();
  EXPECT_EQ(unknown.compared_elements(), 0U);
  EXPECT_FALSE(unknown.has_moment_error());
  EXPECT_FALSE(unknown.within_tolerance());
}

TEST(BeamCodec, SolutionsHaveExtremesAndStations) {
  beams::BeamModel model = decode_structure(scene()).model;
  model.distributed_loads = {{0, {0, 0, -1}}};
  const session::BeamAnalysis analysis = session::analyse(model, {});
  const auto elements = static_cast<std::uint64_t>(model.elements.size());
  const proto::BeamSolution message = encode_beams(analysis, 5);
  const auto shape = [](const proto::Array& array) {
    return std::vector<std::uint64_t>(array.shape().begin(), array.shape().end());
  };
  EXPECT_EQ(shape(message.element_extremes()), (std::vector<std::uint64_t>{elements, 6, 4}));
  EXPECT_EQ(shape(message.stations()), (std::vector<std::uint64_t>{elements, 5, 8}));
  EXPECT_EQ(shape(message.governing_places()), (std::vector<std::uint64_t>{elements}));
  EXPECT_EQ(message.stations().data().size(), elements * 5 * 8 * sizeof(double));
  EXPECT_FALSE(encode_beams(analysis, 0).has_stations());
  proto::GetBeamSolutionRequest request;
  EXPECT_EQ(decode_stations(request), beams::kDefaultStations);
  request.set_stations(1);
  EXPECT_EQ(refused_field([&] { (void)decode_stations(request); }), "stations");
  request.set_stations(0);
  EXPECT_EQ(decode_stations(request), 0);
}

TEST(BeamCodec, AxesOfSupportsAreMadePerpendicular) {
  const beams::BeamSupport support = decode_structure(scene()).model.supports[1];
  const double half = std::sqrt(0.5);
  Eigen::Matrix3d has_subscriber;
  has_subscriber << half, -half, 0, half, half, 0, 0, 0, 1;
  EXPECT_LT((support.axes - has_subscriber).norm(), 1e-12);
  proto::Scene bad = scene();
  bad.mutable_beams()->mutable_structure()->mutable_supports(1)->clear_x_axis();
  EXPECT_EQ(refused_field([&] { decode_structure(bad); }),
            "scene.beams.structure.supports[1].x_axis");
  bad = scene();
  bad.mutable_beams()->mutable_structure()->mutable_supports(1)->clear_y_axis();
  EXPECT_EQ(refused_field([&] { decode_structure(bad); }),
            "scene.beams.structure.supports[1].y_axis");
}

TEST(BeamCodec, IssuesNameTheFieldsOfTheMessage) {
  const auto scene_message = [](const proto::Scene& bad) -> std::pair<std::string, std::string> {
    try {
      decode_structure(bad);
    } catch (const Error& error) {
      return {error.field(), error.what()};
    }
    return {"accepted", ""};
  };
  proto::Scene bad = scene();
  auto* structure = bad.mutable_beams()->mutable_structure();
  structure->mutable_sections(0)->mutable_rectangle()->set_width(0.01);
  structure->mutable_sections(0)->mutable_rectangle()->set_height(-1);
  EXPECT_EQ(scene_message(bad),
            std::pair(std::string("scene.beams.structure.sections[0].rectangle.height"),
                      std::string("height = -1, must be > 0")));
  structure->mutable_sections(0)->mutable_rectangle()->set_height(1e-200);
  EXPECT_EQ(scene_message(bad).first, "scene.beams.structure.sections[0]");
  EXPECT_THAT(scene_message(bad).second, ::testing::StartsWith("sections[0]: its stiffness"));
  bad = scene();
  structure = bad.mutable_beams()->mutable_structure();
  auto* support = structure->mutable_supports(0);
  support->set_fix_y(true);
  auto* motion = structure->add_motions();
  motion->set_node(support->node());
  motion->set_y(0.1);
  EXPECT_FALSE(decode_structure(bad).model.supports[0].fixed[1]) << "motions go before supports";
  *structure->add_motions() = *motion;
  const int last = structure->motions_size() - 1;
  EXPECT_EQ(scene_message(bad).second, fmt::format("motions[{}].node = {}, as that of motions[{}]",
                                                   last, structure->supports(0).node(), last - 1));
}

TEST(BeamCodec, ShapesComeBack) {
  DecodedBeams first = decode_structure(scene());
  beams::BeamState shape = beams::BeamStructure(first.model).rest_state();
  shape.positions.col(1) += Eigen::Vector3d(0.1, 0.2, 0.3);
  shape.rotations[1] = beams::rotation_by({0.3, -0.2, 1.7});
  for (auto& turn : shape.hinge_turns) turn = beams::rotation_by({0, 0.4, 0});
  first.shape = shape;
  proto::Scene scene_message = encode_beam_scene(first);
  const DecodedBeams second = decode_structure(scene_message);
  ASSERT_TRUE(second.shape);
  EXPECT_EQ(second.shape->positions, shape.positions);
  EXPECT_LT(second.shape->rotations[1].angularDistance(shape.rotations[1]), 1e-14);
  EXPECT_EQ(second.shape->hinge_turns.size(), shape.hinge_turns.size());
  auto* message = scene_message.mutable_beams()->mutable_shape();
  *message->mutable_rotations() = encode_points_float64(Eigen::Matrix3Xd::Zero(3, 1));
  EXPECT_EQ(refused_field([&] { decode_structure(scene_message); }), "scene.beams.shape.rotations");
}

TEST(BeamCodec, ShapesThatNoElementCanHaveAreRefused) {
  DecodedBeams first = decode_structure(scene());
  const beams::BeamState rest = beams::BeamStructure(first.model).rest_state();
  const auto scene_message = [&](auto&& spoil) -> std::pair<std::string, std::string> {
    first.shape = rest;
    spoil(*first.shape);
    try {
      decode_structure(encode_beam_scene(first));
    } catch (const Refusal& refusal) {
      return {refusal.field(), refusal.what()};
    }
    return {"accepted", ""};
  };
  const auto [far_field, far_away] =
      scene_message([](auto& shape) { shape.positions(2, 1) = 1e300; });
  EXPECT_EQ(far_field, "scene.beams.shape.positions");
  EXPECT_THAT(far_away, ::testing::HasSubstr("row 1"));
  const beams::BeamElement& element = first.model.elements[1];
  const auto [field, why] = scene_message([&](auto& shape) {
    shape.positions.col(element.finish) = shape.positions.col(element.start);
  });
  EXPECT_EQ(field, "scene.beams.shape.positions");
  EXPECT_THAT(why, ::testing::HasSubstr("element 1"));
}

TEST(BeamCodec, RelaxationsFollowNoBranch) {
  proto::SolveBeamsRequest request;
  *request.mutable_structure() = scene().beams().structure();
  request.set_follow(true);
  for (const auto method : {proto::BEAM_METHOD_UNSPECIFIED, proto::BEAM_METHOD_NEWTON}) {
    request.set_method(method);
    EXPECT_GT(decode_beams(request).options.largest_swerve, 0);
  }
  for (const auto method :
       {proto::BEAM_METHOD_RELAXATION, proto::BEAM_METHOD_RELAXATION_THEN_NEWTON}) {
    request.set_method(method);
    EXPECT_EQ(refused_field([&] { (void)decode_beams(request); }), "follow");
  }
}

TEST(BeamCodec, SourcesExcludeEachOther) {
  proto::Scene both = scene();
  both.mutable_beams()->mutable_lines()->set_path("x.obj");
  EXPECT_EQ(refused_field([&] { decode_structure(both); }), "scene.beams.structure.nodes");
  both = scene();
  both.mutable_beams()->mutable_job()->set_name("SimulationJob.json");
  EXPECT_EQ(refused_field([&] { decode_structure(both); }), "scene.beams.job");
  proto::Scene unit = scene();
  unit.set_length_unit_in_metres(0.001);
  EXPECT_EQ(refused_field([&] { decode_structure(unit); }), "scene.length_unit_in_metres");
}

TEST(BeamCodec, MotionsMayHaveAxesAndSingleRotations) {
  proto::Scene message = scene();
  message.mutable_beams()->mutable_structure()->mutable_supports(1)->set_fix_rotation_x(true);
  auto& scene_message = *message.mutable_beams()->mutable_structure()->add_motions();
  scene_message.set_node(2);
  scene_message.set_y(0.1);
  scene_message.set_rotation_z(0.3);
  *scene_message.mutable_x_axis() = message.beams().structure().supports(1).x_axis();
  *scene_message.mutable_y_axis() = message.beams().structure().supports(1).y_axis();
  const DecodedBeams structure = decode_structure(message);
  const beams::PrescribedMotion& motion = structure.model.motions[1];
  EXPECT_EQ(motion.rotates, (std::array<bool, 3>{false, false, true}));
  EXPECT_EQ(motion.rotation, Eigen::Vector3d(0, 0, 0.3));
  EXPECT_TRUE(motion.axes.isApprox(structure.model.supports[1].axes));
  const proto::BeamMotion back = encode_beam_structure(structure).motions(1);
  EXPECT_TRUE(back.has_y() && back.has_rotation_z());
  EXPECT_FALSE(back.has_x() || back.has_rotation() || back.has_rotation_x());
  EXPECT_TRUE(decode_beam_motion(back, "").axes.isApprox(motion.axes));
  // A position is a place, for any axes.
  proto::EditRequest request;
  auto& move = *request.add_edits()->mutable_move_beam_node();
  *move.mutable_motion() = scene_message;
  move.mutable_motion()->clear_y();
  move.mutable_position()->set_x(1.5);
  const auto edits = decode_beam_edits(request, structure.model.nodes);
  const auto& moved = std::get<session::MoveNode>(edits[0]).motion;
  EXPECT_LT((moved.axes * moved.translation - Eigen::Vector3d(0.5, 0, -2)).norm(), 1e-15);
  scene_message.mutable_rotation()->set_x(1);
  EXPECT_EQ(refused_field([&] { decode_structure(message); }),
            "scene.beams.structure.motions[1].rotation");
  scene_message.clear_rotation();
  scene_message.clear_y_axis();
  EXPECT_EQ(refused_field([&] { decode_structure(message); }),
            "scene.beams.structure.motions[1].y_axis");
}

TEST(BeamCodec, EditsAreReadAndNamed) {
  const auto nodes = decode_structure(scene()).model.nodes;
  proto::EditRequest request;
  auto& move = *request.add_edits()->mutable_move_beam_node();
  move.mutable_motion()->set_node(2);
  move.mutable_position()->set_x(1.5);
  request.add_edits()->mutable_hold_beam_node()->set_node(1);
  request.add_edits()->mutable_set_beam_load()->mutable_load()->set_node(1);
  const auto edits = decode_beam_edits(request, nodes);
  const auto& motion = std::get<session::MoveNode>(edits[0]).motion;
  EXPECT_EQ(motion.translates, (std::array<bool, 3>{true, true, true}));
  EXPECT_EQ(motion.translation, Eigen::Vector3d(0.5, 0, -2)) << "from where it is drawn";
  EXPECT_TRUE(std::get<session::HoldNode>(edits[1]).rotations) << "nothing given: all";
  EXPECT_EQ(field_in(request, "edits[0].node"), "edits[0].move_beam_node.motion.node");
  EXPECT_EQ(field_in(request, "edits[1].node"), "edits[1].hold_beam_node.node");
  EXPECT_EQ(field_in(request, "edits[2].force"), "edits[2].set_beam_load.load.force");
  move.mutable_motion()->set_x(1);
  EXPECT_EQ(refused_field([&] { (void)decode_beam_edits(request, nodes); }),
            "edits[0].move_beam_node.position");
  request.mutable_edits(0)->mutable_set_mean_angle();
  EXPECT_EQ(refused_field([&] { (void)decode_beam_edits(request, nodes); }),
            "edits[0].set_mean_angle");
}

}  // namespace
}  // namespace limber::server
