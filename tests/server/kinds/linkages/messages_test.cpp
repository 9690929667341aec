#include "server/kinds/linkages/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <numbers>

#include "engine/rods/linkage/linkage_state.h"
#include "engine/scene/samples/linkage_samples.h"
#include "server/kinds/linkages/edit.h"
#include "server/kinds/linkages/result.h"
#include "server/kinds/linkages/scenes.h"
#include "server/wire/fields.h"

namespace limber::server {
namespace {

/// Samples and files, but no paths.
const LineLoader no_lines =
    line_loader([](const std::string&, const std::string& field) -> std::filesystem::path {
      throw Error(ErrorCode::kNotFound, field, "there are no paths here");
    });

proto::Array array(proto::DataType type, std::uint64_t columns, const void* data,
                   std::size_t bytes) {
  proto::Array message;
  message.set_type(type);
  message.add_shape(bytes / columns / (type == proto::DATA_TYPE_INT32 ? 4 : 8));
  message.add_shape(columns);
  message.set_data(data, bytes);
  return message;
}

/// Two rods that cross in vertex 1: four segments, one joint.
proto::Scene cross() {
  const double vertices[] = {-1, 0, 0, 0, 0, 0, 1, 0, 0, 0, -1, 0, 0, 1, 0};
  const std::int32_t edges[] = {0, 1, 1, 2, 3, 1, 1, 4};
  proto::Scene scene;
  auto& linkage = *scene.mutable_linkage();
  auto& lines = *linkage.mutable_lines()->mutable_arrays();
  *lines.mutable_vertices() = array(proto::DATA_TYPE_FLOAT64, 3, vertices, sizeof vertices);
  *lines.mutable_edges() = array(proto::DATA_TYPE_INT32, 2, edges, sizeof edges);
  linkage.mutable_section()->mutable_rectangle()->set_width(0.02);
  linkage.mutable_section()->mutable_rectangle()->set_height(0.005);
  return scene;
}

/// The field that opening the scene is refused with; "" if it is not.
std::string refused_scene(const proto::Scene& scene) {
  const auto issues = linkage_issues(scene, "scene.", no_lines, 0);
  return issues.empty() ? "" : issues[0].field();
}

template <class T>
void change(proto::Array& array, std::size_t index, T value) {
  std::memcpy(array.mutable_data()->data() + index * sizeof(T), &value, sizeof(T));
}

TEST(LinkageCodec, DefaultsAreThoseOfTheEngine) {
  const scene::Linkage linkage = decode_linkage(cross(), "", no_lines), standard;
  EXPECT_EQ(linkage.edges_per_segment, standard.edges_per_segment);
  EXPECT_EQ(linkage.youngs_modulus, standard.youngs_modulus);
  EXPECT_EQ(linkage.poissons_ratio, standard.poissons_ratio);
  EXPECT_EQ(linkage.density, standard.density);
  EXPECT_EQ(linkage.length_unit_in_metres, 1);
  EXPECT_EQ(linkage.stiff_axis, standard.stiff_axis);
  EXPECT_EQ(linkage.bending, standard.bending);
  EXPECT_EQ(linkage.rest_lengths, standard.rest_lengths);
  EXPECT_EQ(linkage.lines.vertices.col(4), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(linkage.lines.edges.col(2), Eigen::Vector2i(3, 1));
  EXPECT_EQ(refused_scene(cross()), "");
}

TEST(LinkageCodec, ValidationReportsEveryIssue) {
  proto::Scene scene = cross();
  auto& linkage = *scene.mutable_linkage();
  linkage.mutable_material()->set_youngs_modulus(-1);
  linkage.mutable_material()->set_density(-1);
  linkage.mutable_section()->mutable_rectangle()->set_height(0);
  linkage.mutable_conditions()->add_pins()->set_joint(7);
  linkage.mutable_conditions()->add_loads()->set_joint(8);
  std::vector<std::string> fields;
  for (const auto& issue : linkage_issues(scene, "scene.", no_lines, 0)) {
    fields.push_back(issue.field());
    EXPECT_EQ(issue.severity(), proto::Issue::SEVERITY_ERROR);
  }
  EXPECT_EQ(fields,
            (std::vector<std::string>{
                "scene.linkage.material.youngs_modulus", "scene.linkage.material.density",
                "scene.linkage.section.rectangle.height", "scene.linkage.conditions.pins[0].joint",
                "scene.linkage.conditions.loads[0].joint"}));
}

TEST(LinkageCodec, EverythingButTheLinesComesBack) {
  for (const rods::Section& section : std::vector<rods::Section>{
           rods::Ellipse{3, 2}, rods::ISection{9, 8, 2, 1}, rods::LSection{5, 4, 1},
           rods::PlusSection{5, 4, 1}, rods::Tube{3, 0.5},
           rods::Profile{{{0, 0}, {9, 0}, {0, 9}}, {{{1, 1}, {2, 1}, {1, 2}}}}}) {
    scene::Linkage linkage = scene::make_linkage_sample("grid");
    linkage.section = section;
    linkage.stiff_axis = rods::StiffAxis::kD2;
    linkage.bending = rods::BendingForm::kAveragedFrames;
    linkage.conditions.pins = {{3, scene::Held::kMotion, Eigen::Vector3d(1, 2, 3)},
                               {4, scene::Held::kAngle, {}}};
    linkage.conditions.angles = {{5, 0.25}};
    linkage.conditions.mean_angle = -0.5;
    linkage.conditions.targets = {{7, 2, -1, 0.5, {4, 5, 6}, 10}, {8, -1, 6, 0.25, {7, 8, 9}, 11}};
    linkage.conditions.loads = {{1, {1, 2, 3}, {4, 5, 6}, 7}};
    linkage.conditions.gravity = {0, 0, -9.81};
    scene::LinkageErection erection;
    erection.mean_angle = 0.5;
    erection.path = {0.25, 0.5};
    erection.path_moments = {-1.5e-3, 2.5};
    erection.support = scene::JointLoad{4, {1, 2, 3}, {4, 5, 6}};
    linkage.length_unit_in_metres = 1e-3;
    linkage.conditions.erection = std::make_shared<const scene::LinkageErection>(erection);
    proto::Scene message = encode_linkage(linkage);
    *message.mutable_linkage()->mutable_lines() = cross().linkage().lines();
    const scene::Linkage back = decode_linkage(message, "", no_lines);
    EXPECT_EQ(encode_linkage(back).SerializeAsString(),
              encode_linkage(linkage).SerializeAsString());
    EXPECT_EQ(back.section.index(), section.index());
    EXPECT_EQ(back.conditions.pins[0].position, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(back.conditions.targets[1].segment, 6);
    EXPECT_EQ(back.conditions.targets[1].joint, -1);
    EXPECT_NEAR(*back.conditions.mean_angle, -0.5, 1e-15);
    EXPECT_EQ(back.conditions.loads[0].torque, 7);
    ASSERT_TRUE(back.conditions.erection);
    EXPECT_EQ(back.conditions.erection->path_moments, erection.path_moments) << "N m in any unit";
    ASSERT_TRUE(back.conditions.erection->support);
    EXPECT_EQ(back.conditions.erection->support->moment, Eigen::Vector3d(4, 5, 6));
  }
}

TEST(LinkageCodec, TheShapeComesBackBitForBit) {
  scene::Linkage linkage = scene::make_linkage_sample("hyperboloid");
  const rods::LinkageModel model(rods::build_linkage_graph(linkage.lines),
                                 linkage.edges_per_segment, {});
  linkage.shape = rods::LinkageState(model).numbers(model);
  linkage.shape_conditions = scene::LinkageConditions();
  linkage.shape_conditions->mean_angle = 0.5;
  linkage.shape_conditions->pins = {{3, scene::Held::kMotion, {}}};
  proto::Scene message = encode_linkage(linkage);
  message.mutable_linkage()->mutable_lines()->set_sample("hyperboloid");
  const scene::Linkage back = decode_linkage(message, "", no_lines);
  ASSERT_TRUE(back.shape);
  EXPECT_EQ(back.shape->positions, linkage.shape->positions);
  EXPECT_EQ(back.shape->normals, linkage.shape->normals);
  EXPECT_EQ(back.shape->bisectors, linkage.shape->bisectors);
  EXPECT_EQ(back.shape->opening_angles, linkage.shape->opening_angles);
  EXPECT_EQ(back.shape->lengths, linkage.shape->lengths);
  EXPECT_EQ(back.shape->vertices, linkage.shape->vertices);
  EXPECT_EQ(back.shape->directors, linkage.shape->directors);
  EXPECT_EQ(back.shape->twists, linkage.shape->twists);
  ASSERT_TRUE(back.shape_conditions);
  EXPECT_NEAR(*back.shape_conditions->mean_angle, 0.5, 1e-15);
  EXPECT_EQ(back.shape_conditions->pins[0].joint, 3);
  EXPECT_EQ(refused_scene(message), "");

  message.mutable_linkage()->set_edges_per_segment(4);
  EXPECT_EQ(refused_scene(message), "scene.linkage.shape.vertices");
  message.mutable_linkage()->set_edges_per_segment(10);
  message.mutable_linkage()->mutable_shape()->mutable_conditions()->mutable_pins(0)->set_joint(999);
  EXPECT_EQ(refused_scene(message), "scene.linkage.shape.conditions.pins[0].joint");
  message = encode_linkage(linkage);
  message.mutable_linkage()->mutable_lines()->set_sample("hyperboloid");
  message.mutable_linkage()->mutable_shape()->mutable_lengths()->set_shape(1, 3);
  EXPECT_EQ(refused_scene(message), "scene.linkage.shape.lengths.data");
  message.mutable_linkage()->mutable_shape()->clear_lengths();
  EXPECT_EQ(refused_scene(message), "scene.linkage.shape.lengths");
}

TEST(LinkageCodec, FormsOfBendingAndRestLengthsComeBack) {
  scene::Linkage linkage = scene::make_linkage_sample("grid");
  const auto there_and_back = [&] {
    proto::Scene message = encode_linkage(linkage);
    *message.mutable_linkage()->mutable_lines() = cross().linkage().lines();
    return decode_linkage(message, "", no_lines);
  };
  for (const auto form : {rods::BendingForm::kMaterialFrames, rods::BendingForm::kAveragedFrames,
                          rods::BendingForm::kTurningAngle}) {
    linkage.bending = form;
    EXPECT_EQ(there_and_back().bending, form);
  }
  for (const auto lengths :
       {scene::RestLengthChoice::kAsDrawn, scene::RestLengthChoice::kLeastStress}) {
    linkage.rest_lengths = lengths;
    EXPECT_EQ(there_and_back().rest_lengths, lengths);
  }
  EXPECT_EQ(encode_linkage(linkage).linkage().rest_lengths(), proto::REST_LENGTHS_LEAST_STRESS);
  linkage.bending = rods::BendingForm::kTurningAngle;
  EXPECT_EQ(encode_linkage(linkage).linkage().bending(), proto::ROD_BENDING_TURNING_ANGLE);
}

TEST(LinkageCodec, BendsByTurningAnglesUnlessAFormIsNamed) {
  EXPECT_EQ(decode_linkage(cross(), "", no_lines).bending, rods::BendingForm::kTurningAngle);
}

TEST(LinkageCodec, EdgesAreNamedOrFollowATolerance) {
  proto::Scene scene = cross();
  EXPECT_EQ(decode_linkage(scene, "", no_lines).edges_per_segment, 10);
  scene.mutable_linkage()->set_tolerance(0.001);
  scene::Linkage linkage = decode_linkage(scene, "", no_lines);
  EXPECT_EQ(linkage.edges_per_segment, 0);
  EXPECT_EQ(linkage.tolerance, 0.001);
  EXPECT_FALSE(encode_linkage(linkage).linkage().has_edges_per_segment());
  scene.mutable_linkage()->set_edges_per_segment(7);
  linkage = decode_linkage(scene, "", no_lines);
  EXPECT_EQ(linkage.edges_per_segment, 7);
  EXPECT_EQ(encode_linkage(linkage).linkage().edges_per_segment(), 7U);
  EXPECT_EQ(encode_linkage(linkage).linkage().tolerance(), 0.001);
  for (const double wrong : {0.0, -1.0, 0.2, std::nan("")}) {
    scene.mutable_linkage()->set_tolerance(wrong);
    EXPECT_EQ(refused_scene(scene), "scene.linkage.tolerance") << wrong;
  }
  EXPECT_EQ(most_chosen_edges(linkage, 0), 60);
  EXPECT_EQ(most_chosen_edges(linkage, 4 * 24'000 * 20), 20);  // four segments
  EXPECT_EQ(most_chosen_edges(linkage, 1), 3);
}

TEST(LinkageResults, SayWhatTheirEdgesAreWorth) {
  session::LinkageResult result;
  result.is_final = true;
  EXPECT_FALSE(encode_linkage_result(result, 0.001).has_discretisation_error());
  session::ShapeCheck check;
  check.size = 200;
  check.tolerance = 0.02;
  check.check_ms = 5;
  check.error.max_distance = 6;
  check.error.energy_error = 0.04;
  check.error.worst_joint = 3;
  check.error.edges = 40;
  check.error.compared_edges = 76;
  result.shape_check = std::make_shared<const session::ShapeCheck>(check);
  const auto error = encode_linkage_result(result, 0.001).discretisation_error();
  EXPECT_DOUBLE_EQ(error.position_error(), 0.03);
  EXPECT_DOUBLE_EQ(error.max_distance(), 0.006);  // m
  EXPECT_EQ(error.worst_node(), 3U);
  EXPECT_EQ(error.energy_error(), 0.04);
  EXPECT_EQ(error.elements(), 40U);
  EXPECT_EQ(error.compared_elements(), 76U);
  EXPECT_FALSE(error.within_tolerance());
  EXPECT_EQ(error.check_ms(), 5);
  check.error.message = "none";
  result.shape_check = std::make_shared<const session::ShapeCheck>(check);
  const auto none = encode_linkage_result(result, 0.001).discretisation_error();
  EXPECT_EQ(none.message(), "none");
  EXPECT_FALSE(none.has_position_error());
  result.shape_check.reset();
  result.check_failure = "out of memory";
  EXPECT_EQ(encode_linkage_result(result, 0.001).discretisation_error().message(), "out of memory");
}

TEST(LinkageCodec, AnglesOnTheWireAreDegrees) {
  proto::Scene scene = cross();
  scene.mutable_linkage()->mutable_conditions()->set_mean_angle_degrees(60);
  EXPECT_DOUBLE_EQ(*decode_linkage(scene, "", no_lines).conditions.mean_angle,
                   std::numbers::pi / 3);
}

using Spoil = std::function<void(proto::Scene&)>;

TEST(LinkageCodec, BadInputNamesItsField) {
  const auto lines = [](proto::Scene& s) -> proto::LineArrays& {
    return *s.mutable_linkage()->mutable_lines()->mutable_arrays();
  };
  const auto conditions = [](proto::Scene& s) -> proto::LinkageConditions& {
    return *s.mutable_linkage()->mutable_conditions();
  };
  const std::vector<std::pair<std::string, Spoil>> cases{
      {"mesh", [](auto& s) { s.mutable_mesh()->set_sample("beam"); }},
      {"frames", [](auto& s) { s.set_frames(10); }},
      {"material", [](auto& s) { s.mutable_material()->set_density(1); }},
      {"linkage.lines", [](auto& s) { s.mutable_linkage()->clear_lines(); }},
      {"linkage.lines.sample",
       [](auto& s) { s.mutable_linkage()->mutable_lines()->set_sample("unicorn"); }},
      {"linkage.lines.arrays.edges[2]",
       [&](auto& s) { change<std::int32_t>(*lines(s).mutable_edges(), 4, 9); }},
      {"linkage.lines.arrays.edges[1]",
       [&](auto& s) { change<std::int32_t>(*lines(s).mutable_edges(), 3, 0); }},
      {"linkage.lines.arrays.edges.shape[1]",
       [&](auto& s) {
         lines(s).mutable_edges()->set_shape(0, 2);
         lines(s).mutable_edges()->set_shape(1, 4);
       }},
      {"linkage.lines.arrays.vertices.data[4]",
       [&](auto& s) { change(*lines(s).mutable_vertices(), 4, std::nan("")); }},
      {"linkage.section", [](auto& s) { s.mutable_linkage()->clear_section(); }},
      {"linkage.section.rectangle.height",
       [](auto& s) {
         s.mutable_linkage()->mutable_section()->mutable_rectangle()->set_height(-1);
       }},
      {"linkage.section.tube.wall_thickness",
       [](auto& s) { s.mutable_linkage()->mutable_section()->mutable_tube()->set_diameter(1); }},
      {"linkage.edges_per_segment", [](auto& s) { s.mutable_linkage()->set_edges_per_segment(2); }},
      {"linkage.material.youngs_modulus",
       [](auto& s) { s.mutable_linkage()->mutable_material()->set_youngs_modulus(0); }},
      {"linkage.conditions.pins[0].joint",
       [&](auto& s) { conditions(s).add_pins()->set_joint(1); }},
      {"linkage.conditions.pins[0].held",
       [&](auto& s) { conditions(s).add_pins()->set_held(proto::HELD_NOTHING); }},
      {"linkage.conditions.pins[1].joint",
       [&](auto& s) {
         conditions(s).add_pins();
         conditions(s).add_pins();
       }},
      {"linkage.conditions.angles[0].angle_degrees",
       [&](auto& s) { conditions(s).add_angles()->set_angle_degrees(180); }},
      {"linkage.conditions.mean_angle_degrees",
       [&](auto& s) {
         conditions(s).set_mean_angle_degrees(20);
         conditions(s).add_angles()->set_angle_degrees(30);  // of the only joint
       }},
      {"linkage.conditions.targets[0]", [&](auto& s) { conditions(s).add_targets(); }},
      {"linkage.conditions.targets[0].segment.segment",
       [&](auto& s) {
         auto& target = *conditions(s).add_targets();
         target.mutable_segment()->set_segment(4);
         target.mutable_position();
         target.set_stiffness(1);
       }},
      {"linkage.conditions.targets[0].segment.share",
       [&](auto& s) {
         auto& target = *conditions(s).add_targets();
         target.mutable_segment()->set_share(2);
         target.mutable_position();
         target.set_stiffness(1);
       }},
      {"linkage.conditions.targets[0].stiffness",
       [&](auto& s) {
         auto& target = *conditions(s).add_targets();
         target.set_joint(0);
         target.mutable_position();
       }},
      {"linkage.conditions.loads[0].force",
       [&](auto& s) { conditions(s).add_loads()->mutable_force()->set_x(std::nan("")); }},
  };
  for (const auto& [field, spoil] : cases) {
    proto::Scene scene = cross();
    spoil(scene);
    EXPECT_EQ(refused_scene(scene), "scene." + field);
  }
}

TEST(LinkageCodec, LinesOfAFileAreNamedAsAWhole) {
  proto::Scene scene = cross();
  scene.mutable_linkage()->mutable_lines()->mutable_file()->set_name("a.obj");
  EXPECT_EQ(linkage_field_in(scene, "lines.edges[3]"), "linkage.lines.file");
}

TEST(LinkageCodec, EditsAndTheirFields) {
  proto::EditRequest request;
  auto& pin = *request.add_edits()->mutable_pin_joint()->mutable_pin();
  pin.set_joint(3);
  pin.set_held(proto::HELD_NOTHING);
  request.add_edits()->mutable_set_mean_angle()->set_angle_degrees(90);
  request.add_edits()->mutable_set_joint_angle()->set_joint(2);
  auto& target = *request.add_edits()->mutable_add_target()->mutable_target();
  target.mutable_segment()->set_segment(5);
  target.mutable_position()->set_z(2);
  target.set_stiffness(10);
  request.add_edits()->mutable_undo();
  const auto edits = decode_linkage_edits(request);
  ASSERT_EQ(edits.size(), 5u);
  EXPECT_FALSE(std::get<session::PinJoint>(edits[0]).held);
  EXPECT_DOUBLE_EQ(*std::get<session::SetMeanAngle>(edits[1]).angle, std::numbers::pi / 2);
  EXPECT_FALSE(std::get<session::SetJointAngle>(edits[2]).angle) << "absent: the joint is free";
  EXPECT_EQ(std::get<session::AddTarget>(edits[3]).target.segment, 5);
  EXPECT_TRUE(std::holds_alternative<session::Undo>(edits[4]));

  EXPECT_EQ(field_in(request, "edits[0].joint"), "edits[0].pin_joint.pin.joint");
  EXPECT_EQ(field_in(request, "edits[0].mean_angle"), "edits[0].pin_joint.pin");
  EXPECT_EQ(field_in(request, "edits[1].mean_angle"), "edits[1].set_mean_angle.angle_degrees");
  EXPECT_EQ(field_in(request, "edits[3].share"), "edits[3].add_target.target.segment.share");
  EXPECT_EQ(field_in(request, "edits[3].target"), "edits[3].add_target.target");
  EXPECT_EQ(field_in(request, "edits[4]"), "edits[4].undo");
  EXPECT_EQ(field_in(request, "expected_revision"), "expected_revision");

  request.add_edits()->mutable_set_ends();
  try {
    (void)decode_linkage_edits(request);
    FAIL() << "an edit of bodies was taken";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
    EXPECT_EQ(refusal.field(), "edits[5].set_ends");
  }
}

TEST(LinkageCodec, EnergiesAreInJouleForAnyLengthUnit) {
  session::LinkageResult result;
  result.is_final = true;
  result.report.status = rods::EquilibriumStatus::kSaddle;
  result.report.energies = {1000, 2000, 3000};
  result.report.spring_energy = 4000;
  result.mean_angle = std::numbers::pi / 4;
  const auto info = encode_linkage_result(result, 0.001);
  EXPECT_EQ(info.status(), proto::SOLVE_STATUS_SADDLE);
  EXPECT_DOUBLE_EQ(info.linkage().stretching_energy(), 1);
  EXPECT_DOUBLE_EQ(info.linkage().bending_energy(), 2);
  EXPECT_DOUBLE_EQ(info.linkage().twisting_energy(), 3);
  EXPECT_DOUBLE_EQ(info.total_energy(), 10);
  EXPECT_DOUBLE_EQ(info.linkage().mean_angle_degrees(), 45);
  result.is_final = false;
  EXPECT_EQ(encode_linkage_result(result, 1).status(), proto::SOLVE_STATUS_IMPROVED);
}

}  // namespace
}  // namespace limber::server
