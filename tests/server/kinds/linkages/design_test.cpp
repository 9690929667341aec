#include "server/kinds/linkages/design.h"

#include <gtest/gtest.h>

#include <cstring>

#include "engine/rods/design/mesh_surface.h"
#include "server/kinds/linkages/edit.h"
#include "server/wire/fields.h"

namespace limber::server {
namespace {

const SurfaceLoader no_files = [](const std::string&,
                                  const std::string& field) -> scene::TriangleSurface {
  throw Error(ErrorCode::kNotFound, field, "there are no files here");
};

template <class T>
proto::Array array(proto::DataType type, const std::vector<T>& values) {
  proto::Array message;
  message.set_type(type);
  message.add_shape(values.size() / 3);
  message.add_shape(3);
  message.set_data(values.data(), values.size() * sizeof(T));
  return message;
}

/// A unit square in the plane z = 2.
proto::DesignSurface square() {
  proto::DesignSurface surface;
  *surface.mutable_triangles()->mutable_vertices() =
      array<double>(proto::DATA_TYPE_FLOAT64, {0, 0, 2, 1, 0, 2, 1, 1, 2, 0, 1, 2});
  *surface.mutable_triangles()->mutable_triangles() =
      array<std::int32_t>(proto::DATA_TYPE_INT32, {0, 1, 2, 0, 2, 3});
  return surface;
}

template <class Call>
std::string refused(const Call& call) {
  try {
    (void)call();
  } catch (const Refusal& refusal) {
    return refusal.field();
  } catch (const Error& error) {
    return error.field();
  }
  return "";
}

TEST(DesignCodec, DefaultsAreThoseOfTheEngine) {
  const session::DesignRequest design = decode_design({}, no_files), standard;
  EXPECT_EQ(design.goal.flat_share, standard.goal.flat_share);
  EXPECT_EQ(design.goal.distance_weight, standard.goal.distance_weight);
  EXPECT_EQ(design.goal.surface_weight, standard.goal.surface_weight);
  EXPECT_EQ(design.shortest, standard.shortest);
  EXPECT_EQ(design.longest, standard.longest);
  EXPECT_EQ(design.max_iterations, standard.max_iterations);
  EXPECT_FALSE(design.flat_height);
  EXPECT_FALSE(design.smallest_angle);
  EXPECT_FALSE(design.flat_angle);
  EXPECT_FALSE(design.goal.surface);
}

TEST(DesignCodec, ASurfaceIsTurnedScaledAndMoved) {
  proto::StartDesignRequest request;
  *request.mutable_goal()->mutable_surface() = square();
  auto& placement = *request.mutable_goal()->mutable_placement();
  placement.mutable_rotation_degrees()->set_x(90);  // z = 2 to y = -2
  placement.set_scale(10);
  placement.mutable_translation()->set_z(5);
  const auto surface = decode_design(request, no_files).goal.placed_surface();
  ASSERT_TRUE(surface);
  const rods::ClosestPoint found = surface->closest({3, 7, 9});
  EXPECT_LT((found.position - Eigen::Vector3d(3, -20, 9)).norm(), 1e-12);
}

TEST(DesignCodec, FilesPointsAndTrianglesMakeTheSameSurface) {
  const auto closest = [](const proto::DesignSurface& surface, const SurfaceLoader& load) {
    proto::ChangeDesignRequest request;
    *request.mutable_surface() = surface;
    return (*decode_design_change(request, load).surface)->closest({0.25, 0.5, 7}).position;
  };
  const Eigen::Vector3d expected(0.25, 0.5, 2);
  EXPECT_EQ(closest(square(), no_files), expected);
  proto::DesignSurface file, points, path;
  file.mutable_file()->set_name("square.obj");
  file.mutable_file()->set_content("v 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\nf 1 2 3 4\n");
  EXPECT_EQ(closest(file, no_files), expected);
  *points.mutable_points() =
      array<double>(proto::DATA_TYPE_FLOAT64, {0, 0, 2, 1, 0, 2, 1, 1, 2, 0, 1, 2});
  EXPECT_LT((closest(points, no_files) - expected).norm(), 1e-12);
  path.set_path("square.obj");
  const SurfaceLoader load = [](const std::string& name, const std::string& field) {
    EXPECT_EQ(name, "square.obj");
    EXPECT_EQ(field, "surface.path");
    scene::TriangleSurface surface;
    surface.vertices.resize(3, 3);
    surface.vertices << 0, 1, 0, 0, 0, 1, 2, 2, 2;
    surface.triangles.resize(3, 1);
    surface.triangles << 0, 1, 2;
    return surface;
  };
  EXPECT_EQ(closest(path, load), expected);
}

TEST(DesignCodec, ASurfaceWithoutASourceTakesTheOneThereIsAway) {
  proto::ChangeDesignRequest request;
  EXPECT_FALSE(decode_design_change(request, no_files).surface);
  request.mutable_surface();
  const auto change = decode_design_change(request, no_files);
  ASSERT_TRUE(change.surface);
  EXPECT_FALSE(*change.surface);
}

TEST(DesignCodec, WeightsOfJointsChangeWhereTheyAreGiven) {
  proto::ChangeDesignRequest request;
  EXPECT_FALSE(decode_design_change(request, no_files).joint_surface_weights);
  request.mutable_joint_surface_weights();
  session::DesignGoal goal;
  goal.joint_surface_weights = Eigen::Vector3d(1, 2, 3);
  decode_design_change(request, no_files).apply_to(goal);
  EXPECT_EQ(goal.joint_surface_weights.size(), 0) << "all 1 again";
  request.mutable_joint_surface_weights()->add_weights(0);
  request.mutable_joint_surface_weights()->add_weights(2);
  decode_design_change(request, no_files).apply_to(goal);
  EXPECT_EQ(goal.joint_surface_weights, Eigen::Vector2d(0, 2));
}

TEST(DesignCodec, WhatIsWrongWithASurfaceIsNamedWhereItIs) {
  const auto start = [](const proto::DesignSurface& surface) {
    proto::StartDesignRequest request;
    *request.mutable_goal()->mutable_surface() = surface;
    return refused([&] { return decode_design(request, no_files); });
  };
  EXPECT_EQ(start(square()), "");
  EXPECT_EQ(start({}), "goal.surface");
  proto::DesignSurface surface = square();
  *surface.mutable_triangles()->mutable_triangles() =
      array<std::int32_t>(proto::DATA_TYPE_INT32, {0, 1, 2, 0, 2, 4});
  EXPECT_EQ(start(surface), "goal.surface.triangles.triangles[1]");
  *surface.mutable_triangles()->mutable_triangles() =
      array<float>(proto::DATA_TYPE_FLOAT32, {0, 1, 2});
  EXPECT_EQ(start(surface), "goal.surface.triangles.triangles.type");
  surface.mutable_triangles()->clear_triangles();
  EXPECT_EQ(start(surface), "goal.surface.triangles.triangles.type");
  surface = {};
  surface.mutable_file()->set_name("none.obj");
  EXPECT_EQ(start(surface), "goal.surface.file");
  surface.mutable_file()->set_name("none.txt");
  EXPECT_EQ(start(surface), "goal.surface.file");
  surface.set_path("away.obj");
  EXPECT_EQ(start(surface), "goal.surface.path");
  *surface.mutable_points() =
      array<double>(proto::DATA_TYPE_FLOAT64, {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3});
  EXPECT_EQ(start(surface), "goal.surface.points");
}

TEST(DesignCodec, FieldsOfTheEngineAreThoseOfTheRequest) {
  proto::StartDesignRequest start;
  *start.mutable_goal()->mutable_surface() = square();
  EXPECT_EQ(field_in(start, "smallest_angle"), "smallest_angle_degrees");
  EXPECT_EQ(field_in(start, "flat_angle"), "flat_angle_degrees");
  start.set_flat_angle_degrees(90);
  EXPECT_NEAR(decode_design(start, no_files).flat_angle.value(), 1.5707963267948966, 1e-15);
  EXPECT_EQ(field_in(start, "goal.surface"), "goal.surface.triangles");
  EXPECT_EQ(field_in(start, "goal.placement.rotation"), "goal.placement.rotation_degrees");
  EXPECT_EQ(field_in(start, "goal.targets[2].joint"), "goal.targets[2].joint");
  proto::ChangeDesignRequest change;
  EXPECT_EQ(field_in(change, "targets[2].joint"), "targets.targets[2].joint");
  EXPECT_EQ(field_in(change, "distance_weight"), "distance_weight");
  EXPECT_EQ(field_in(change, "joint_surface_weights[3]"), "joint_surface_weights.weights[3]");
  proto::DesignTarget& target = *start.mutable_goal()->add_targets();
  target.set_joint(3);
  EXPECT_EQ(refused([&] { return decode_design(start, no_files); }), "goal.targets[0].position");
}

TEST(DesignCodec, InfosAreInDegreesAndJoule) {
  session::DesignInfo info;
  info.tag = 9;
  info.state = session::DesignState::kEnded;
  info.end = session::DesignEnd::kFailed;
  info.message = "why";
  info.fault_field = "flat";
  info.fault = ErrorCode::kNumerical;
  info.now.deployed_energy = 3;
  info.now.smallest_angle = 1;
  info.taken = 4;
  const proto::DesignInfo message = encode_design(info, 1e-3);
  EXPECT_EQ(message.job(), 9U);
  EXPECT_EQ(message.end(), proto::DESIGN_END_FAILED);
  EXPECT_EQ(message.error().field(), "flat");
  EXPECT_EQ(message.error().code(), proto::ERROR_CODE_NUMERICAL);
  EXPECT_EQ(message.error().message(), "why");
  EXPECT_DOUBLE_EQ(message.now().deployed_energy(), 3e-3);
  EXPECT_NEAR(message.now().smallest_angle_degrees(), 57.29577951308232, 1e-12);
  EXPECT_EQ(message.taken_revision(), 4U);
  EXPECT_FALSE(message.has_flat_angle_degrees());
  info.flat_angle = 0.5;
  info.fault_field = "flat_angle";
  EXPECT_NEAR(encode_design(info, 1).flat_angle_degrees(), 28.64788975654116, 1e-12);
  EXPECT_EQ(encode_design(info, 1).error().field(), "flat_angle_degrees");
  info.taken.reset();
  info.end = session::DesignEnd::kSettled;
  EXPECT_FALSE(encode_design(info, 1).has_taken_revision());
  EXPECT_FALSE(encode_design(info, 1).has_error());
}

TEST(DesignCodec, VariablesBoundsAndTheGuardArrive) {
  proto::StartDesignRequest request;
  request.set_lengths(proto::DESIGN_LENGTHS_EDGES);
  request.set_sections(proto::DESIGN_SECTIONS_SEGMENTS);
  request.set_thinnest(0.7);
  request.add_thickest_sections(1.5);
  request.set_guard(proto::DESIGN_GUARD_NEVER);
  *request.mutable_fitted_points() = array<double>(proto::DATA_TYPE_FLOAT64, {1, 2, 3, 4, 5, 6});
  const session::DesignRequest design = decode_design(request, no_files);
  EXPECT_EQ(design.variables.lengths, rods::LengthVariables::kEdges);
  EXPECT_EQ(design.variables.sections, rods::SectionVariables::kSegments);
  EXPECT_EQ(design.thinnest, 0.7);
  EXPECT_EQ(design.thickest, 2);
  EXPECT_EQ(design.thickest_sections.size(), 1);
  EXPECT_EQ(design.guard, rods::BucklingGuard::kNever);
  EXPECT_EQ(design.fitted_points.col(1), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(field_in(request, "lengths"), "lengths");
}

TEST(DesignCodec, InfosTellTrialsOtherOptimaAndWhereTheSurfaceIs) {
  session::DesignInfo info;
  info.variables = {rods::LengthVariables::kKept, rods::SectionVariables::kSegments};
  info.guard = rods::BucklingGuard::kFromStart;
  info.trials = {3, 5, 4, true, "lost"};
  info.sections_at_bound = {2};
  info.other_optima.push_back({9, {}, {0.02, 1, 2}});
  info.other_optima[0].terms.deployed_energy = 3;
  info.goal.surface = decode_design(
                          [] {
                            proto::StartDesignRequest request;
                            *request.mutable_goal()->mutable_surface() = square();
                            return request;
                          }(),
                          no_files)
                          .goal.surface;
  info.goal.placement.rotation = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY());
  const proto::DesignInfo message = encode_design(info, 0.5);
  EXPECT_EQ(message.lengths(), proto::DESIGN_LENGTHS_KEPT);
  EXPECT_EQ(message.sections(), proto::DESIGN_SECTIONS_SEGMENTS);
  EXPECT_EQ(message.guard(), proto::DESIGN_GUARD_FROM_START);
  EXPECT_EQ(message.refused(), 3U);
  EXPECT_EQ(message.not_believed(), 5U);
  EXPECT_EQ(message.flat_lost(), 4U);
  EXPECT_TRUE(message.guarded());
  EXPECT_EQ(message.refusal(), "lost");
  EXPECT_EQ(message.sections_at_bound(0), 2U);
  ASSERT_EQ(message.other_optima_size(), 1);
  EXPECT_EQ(message.other_optima(0).job(), 9U);
  EXPECT_EQ(message.other_optima(0).size_difference(), 0.02);
  EXPECT_EQ(message.other_optima(0).deployed_distance(), 2);
  EXPECT_EQ(message.other_optima(0).terms().deployed_energy(), 1.5);
  EXPECT_NEAR(message.placement().rotation_degrees().y(), 0.5 * 180 / 3.14159265358979, 1e-9);
}

TEST(DesignCodec, EdgesAndSectionsAreEdits) {
  proto::EditRequest request;
  request.add_edits()->mutable_set_edge_lengths()->add_lengths(2);
  request.add_edits()->mutable_set_section_scales()->add_scales(3);
  const auto edits = decode_linkage_edits(request);
  EXPECT_EQ(std::get<session::SetEdgeLengths>(edits[0]).lengths[0], 2);
  EXPECT_EQ(std::get<session::SetSectionScales>(edits[1]).scales[0], 3);
  EXPECT_EQ(field_in(request, "edits[0].edge_lengths[4]"), "edits[0].set_edge_lengths.lengths[4]");
  EXPECT_EQ(field_in(request, "edits[1].section_scales"), "edits[1].set_section_scales.scales");
}

TEST(DesignCodec, LengthsAreEdits) {
  proto::EditRequest request;
  auto& set = *request.add_edits()->mutable_set_segment_lengths();
  set.add_lengths(1.5);
  set.add_lengths(2.5);
  const auto edits = decode_linkage_edits(request);
  const auto& lengths = std::get<session::SetSegmentLengths>(edits.at(0)).lengths;
  EXPECT_EQ(lengths, Eigen::Vector2d(1.5, 2.5));
  EXPECT_EQ(field_in(request, "edits[0].segment_lengths[1]"),
            "edits[0].set_segment_lengths.lengths[1]");
  EXPECT_EQ(field_in(request, "edits[0].segment_lengths"), "edits[0].set_segment_lengths.lengths");
}

}  // namespace
}  // namespace limber::server
