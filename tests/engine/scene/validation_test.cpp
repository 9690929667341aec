#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "engine/scene/samples/samples.h"
#include "engine/scene/scene.h"
#include "tests/engine/scene/not_finite.h"

namespace limber::scene {
namespace {

using ::testing::HasSubstr;
using testing::kInfinity;
using testing::kNan;

Scene good_scene() { return make_sample("beam"); }

/// The scene with a mesh of one tet, three of its nodes fixed: three degrees of freedom.
Scene of_one_tet(Scene scene) {
  scene.mesh = {};
  scene.mesh.nodes.resize(3, 4);
  scene.mesh.nodes.transpose() << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1;
  scene.mesh.tets.resize(4, 1);
  scene.mesh.tets << 0, 1, 2, 3;
  scene.fixed_nodes = {0, 1, 2};
  scene.constraints.clear();
  return scene;
}

int errors(const std::vector<Issue>& issues) {
  return static_cast<int>(std::count_if(issues.begin(), issues.end(), [](const Issue& issue) {
    return issue.severity == Issue::Severity::kError;
  }));
}

struct SceneFault {
  const char* field;
  std::function<void(Scene&)> make;
  Issue::Severity severity = Issue::Severity::kError;
  ErrorCode code = ErrorCode::kInvalidArgument;
};

constexpr auto kError = Issue::Severity::kError;

TEST(Validation, AGoodSceneHasNoIssues) { EXPECT_TRUE(validate(good_scene()).empty()); }

TEST(Validation, BaseMotionsSayWhatDiffers) {
  Scene scene = good_scene();
  const auto message = [&] { return validate(scene).at(0).message; };
  scene.base_motion = Eigen::MatrixXd::Zero(3 * 1377, 149);
  EXPECT_EQ(message(), "has 149 frames, the scene has 150");
  scene.base_motion = Eigen::MatrixXd::Zero(3 * 1376, 150);
  EXPECT_EQ(message(), "has 1376 nodes, the mesh has 1377");
  scene.base_motion = Eigen::MatrixXd::Zero(3 * 1377, 150);
  scene.base_motion(3 * 8 + 2, 17) = kNan;
  EXPECT_EQ(message(), "has a value that is not finite: node 8 in frame 17");
}

TEST(Validation, EachFaultIsNamedAloneWithItsField) {
  const SceneFault faults[] = {
      {"length_unit_in_metres", [](Scene& s) { s.length_unit_in_metres = 0; }},
      {"length_unit_in_metres", [](Scene& s) { s.length_unit_in_metres = kNan; }},
      {"length_unit_in_metres", [](Scene& s) { s.length_unit_in_metres = 1e-31; }},
      {"length_unit_in_metres", [](Scene& s) { s.length_unit_in_metres = 1e100; }},
      {"material.youngs_modulus", [](Scene& s) { s.material.youngs_modulus = -1; }},
      {"material.youngs_modulus", [](Scene& s) { s.material.youngs_modulus = 1e308; }},
      {"material.youngs_modulus", [](Scene& s) { s.material.youngs_modulus = 1e-300; }},
      {"material.poissons_ratio", [](Scene& s) { s.material.poissons_ratio = 0.5; }},
      {"material.density", [](Scene& s) { s.material.density = kInfinity; }},
      {"material.density", [](Scene& s) { s.material.density = 1e300; }},
      {"material.density", [](Scene& s) { s.material.density = 1e-300; }},
      {"merge_tolerance", [](Scene& s) { s.merge_tolerance = -1e-9; }},
      {"frames",
       [](Scene& s) {
         s.frame_count = 2;
         s.constraints.clear();
       }},
      {"frames",
       [](Scene& s) {
         s.frame_count = 4;
         s.constraints.clear();
       }},
      {"dynamics.frames_per_second", [](Scene& s) { s.dynamics.frames_per_second = 0; }},
      {"dynamics.period_frames", [](Scene& s) { s.dynamics.period_frames = -1; }},
      {"dynamics.period_frames", [](Scene& s) { s.dynamics.period_frames = 2; },
       Issue::Severity::kWarning},
      {"dynamics.damping_ratio", [](Scene& s) { s.dynamics.damping_ratio = 1; }},
      {"model.modes", [](Scene& s) { s.model.mode_count = 0; }},
      {"model.modes", [](Scene& s) { s.model.mode_count = 3 * (1377 - 162); }},
      {"model.modes",
       [](Scene& s) {
         s = of_one_tet(s);
         s.model.mode_count = 31;
       }},
      {"model.modes", [](Scene& s) { s = of_one_tet(s); }, Issue::Severity::kWarning},
      {"model.tolerance", [](Scene& s) { s.model.tolerance = kNan; }},
      {"model.basis_size", [](Scene& s) { s.model.basis_size = -1; }},
      {"model.basis_size", [](Scene& s) { s.model.basis_size = 5000; }, Issue::Severity::kWarning},
      {"model.cubature_size", [](Scene& s) { s.model.cubature_size = 7000; }},
      {"mesh.nodes", [](Scene& s) { s.mesh.nodes *= 1e-100; }},
      {"mesh.nodes",
       [](Scene& s) {
         s.mesh.nodes *= 1e20;
         s.length_unit_in_metres = 1e20;
       }},
      {"mesh.nodes[17]", [](Scene& s) { s.mesh.nodes(1, 17) = kNan; }},
      {"mesh.tets[9]", [](Scene& s) { s.mesh.tets(2, 9) = 1377; }, kError, ErrorCode::kOutOfRange},
      {"mesh.tets[9]", [](Scene& s) { s.mesh.tets(2, 9) = s.mesh.tets(0, 9); }},
      {"mesh.tet_material", [](Scene& s) { s.mesh.materials = {s.material}; }},
      {"mesh.tet_material[5]",
       [](Scene& s) {
         s.mesh.materials = {s.material};
         s.mesh.tet_material.assign(6144, 0);
         s.mesh.tet_material[5] = 1;
       },
       kError, ErrorCode::kOutOfRange},
      {"mesh.materials[0].density",
       [](Scene& s) {
         s.mesh.materials = {{1e6, 0.3, 0}};
         s.mesh.tet_material.assign(6144, 0);
       }},
      {"fixed_nodes[3]", [](Scene& s) { s.fixed_nodes[3] = -1; }, kError, ErrorCode::kOutOfRange},
      {"fixed_nodes", [](Scene& s) { s.fixed_nodes.push_back(s.fixed_nodes[0]); },
       Issue::Severity::kWarning},
      {"constraints[1].frame", [](Scene& s) { s.constraints[1].frame = 150; }, kError,
       ErrorCode::kOutOfRange},
      {"constraints[1].frame", [](Scene& s) { s.constraints[1].frame = 148; },
       Issue::Severity::kWarning},
      {"constraints[1].frame",
       [](Scene& s) {
         s.constraints[1].frame = 149;
         s.constraints[1].kind = TargetKind::kVelocity;
       },
       Issue::Severity::kWarning},
      {"constraints[1].nodes", [](Scene& s) { s.constraints[1].nodes.clear(); }},
      {"constraints[1].nodes[0]", [](Scene& s) { s.constraints[1].nodes = {5000}; }, kError,
       ErrorCode::kOutOfRange},
      {"constraints[1].nodes[1]",
       [](Scene& s) {
         s.constraints[1].nodes = {1000, 1000};
       }},
      {"constraints[1].nodes", [](Scene& s) { s.constraints[1].nodes = {s.fixed_nodes[0]}; },
       Issue::Severity::kWarning},
      {"constraints[1].point", [](Scene& s) { s.constraints[1].point = SurfacePoint(); }},
      {"constraints[1].surface_vertex", [](Scene& s) { s.constraints[1].surface_vertex = 0; }},
      {"constraints[1].point.triangle",
       [](Scene& s) {
         s.constraints[1].nodes.clear();
         s.constraints[1].point = SurfacePoint{100000, {1, 0, 0}};
       },
       kError, ErrorCode::kOutOfRange},
      {"constraints[1].point.weights",
       [](Scene& s) {
         s.constraints[1].nodes.clear();
         s.constraints[1].point = SurfacePoint{0, {0.5, 0.4, 0}};
       }},
      {"constraints[1].point.surface",
       [](Scene& s) {
         s.constraints[1].nodes.clear();
         s.constraints[1].point = SurfacePoint{0, {1, 0, 0}, PointSurface::kCarried};
       }},
      {"constraints[2].axes", [](Scene& s) { s.constraints[2].axes = 0; }},
      {"constraints[2].axes", [](Scene& s) { s.constraints[2].axes = 8; }},
      {"constraints[0].target", [](Scene& s) { s.constraints[0].target[2] = kNan; }},
      {"constraints[0].weight", [](Scene& s) { s.constraints[0].weight = 0; }},
      {"constraints[0].weight", [](Scene& s) { s.constraints[0].weight = 1e13; }, kError,
       ErrorCode::kOutOfRange},
      {"constraints[3].id", [](Scene& s) { s.constraints[0].id = s.constraints[3].id = 12; },
       kError, ErrorCode::kAlreadyExists},
      {"base_motion", [](Scene& s) { s.base_motion = Eigen::MatrixXd::Zero(5, 150); }},
      {"base_motion", [](Scene& s) { s.base_motion = Eigen::MatrixXd::Zero(3 * 1377, 149); }},
      {"base_motion", [](Scene& s) { s.base_motion = Eigen::MatrixXd::Zero(3 * 1377, 151); }},
      {"base_motion",
       [](Scene& s) { s.base_motion = Eigen::MatrixXd::Constant(3 * 1377, 150, kNan); }},
      {"base_motion",
       [](Scene& s) { s.base_motion = Eigen::MatrixXd::Constant(3 * 1377, 150, 1e39); }, kError,
       ErrorCode::kOutOfRange},
  };
  for (const SceneFault& fault : faults) {
    Scene scene = good_scene();
    fault.make(scene);
    const std::vector<Issue> issues = validate(scene);
    ASSERT_EQ(issues.size(), 1) << fault.field << ": "
                                << (issues.empty() ? "nothing" : issues[0].field);
    EXPECT_EQ(issues[0].field, fault.field);
    EXPECT_EQ(issues[0].severity, fault.severity);
    EXPECT_EQ(issues[0].code, fault.code) << fault.field;
    EXPECT_FALSE(issues[0].message.empty());
  }
}

TEST(Validation, AllFaultsAreReportedAtOnce) {
  Scene scene = good_scene();
  scene.length_unit_in_metres = -1;
  scene.model.mode_count = 0;
  scene.mesh.nodes(0, 0) = kNan;
  scene.fixed_nodes = {99999};
  scene.constraints[0].frame = -1;
  scene.constraints[1].weight = kNan;
  EXPECT_EQ(errors(validate(scene)), 6);
}

TEST(Validation, AMillionFaultsMakeAShortList) {
  Scene scene = good_scene();
  scene.mesh.nodes.setConstant(kNan);
  scene.mesh.tets.setConstant(-7);
  scene.fixed_nodes.assign(10000, -3);
  EXPECT_LT(validate(scene).size(), 150);
}

TEST(Validation, AnEmptySceneIsSurvived) {
  const std::vector<Issue> issues = validate(Scene{});
  EXPECT_GE(errors(issues), 3);  // nodes, tets, frames
}

TEST(Validation, WhatOnlyThePreparedMeshShowsIsReported) {
  Scene flat = good_scene();
  flat.mesh.nodes.row(1).setZero();
  ASSERT_EQ(errors(validate(flat)), 1);

  // A second bar far away with nothing fixed.
  Scene two = good_scene();
  const int n = two.mesh.node_count(), m = two.mesh.tet_count();
  two.mesh.nodes.conservativeResize(3, 2 * n);
  two.mesh.nodes.rightCols(n) = two.mesh.nodes.leftCols(n).colwise() + Eigen::Vector3d(5, 0, 0);
  two.mesh.tets.conservativeResize(4, 2 * m);
  two.mesh.tets.rightCols(m) = two.mesh.tets.leftCols(m).array() + n;
  EXPECT_EQ(errors(validate(two)), 1);

  Scene turned = good_scene();
  turned.mesh.tets.row(2).swap(turned.mesh.tets.row(3));
  const std::vector<Issue> issues = validate(turned);
  ASSERT_EQ(issues.size(), 1);
  EXPECT_EQ(issues[0].severity, Issue::Severity::kWarning);

  Scene unused = good_scene();
  unused.mesh.nodes.conservativeResize(3, n + 1);
  unused.mesh.nodes.col(n).setZero();
  unused.constraints[0].nodes = {n};
  const std::vector<Issue> with_unused = validate(unused);
  EXPECT_EQ(errors(with_unused), 1);
  EXPECT_THAT(with_unused, ::testing::Contains(
                               ::testing::Field(&Issue::message, HasSubstr("belongs to no tet"))));
}

TEST(Validation, UnitsDoNotChangeTheVerdict) {
  Scene scene = good_scene();
  scene.mesh.nodes *= 1e6;
  scene.length_unit_in_metres = 1e-6;
  scene.merge_tolerance = 1.0;
  EXPECT_TRUE(validate(scene).empty());
}

TEST(VelocitySpan, IsCentralAndOneSidedAtTheEnds) {
  const auto is = [](int frame, int since, int until) {
    const VelocitySpan span = velocity_span(frame, 10);
    return span.since == since && span.until == until;
  };
  EXPECT_TRUE(is(0, 0, 1));
  EXPECT_TRUE(is(1, 0, 2));
  EXPECT_TRUE(is(8, 7, 9));
  EXPECT_TRUE(is(9, 8, 9));
}

TEST(VelocitySpan, HasNoEffectWhereBothFramesAreHeld) {
  Constraint velocity;
  velocity.kind = TargetKind::kVelocity;
  const auto idle = [&](int frame, End first, End last) {
    velocity.frame = frame;
    return idle_frame_warning(velocity, 10, first, last).has_value();
  };
  constexpr End kFree = End::kFree, kHeld = End::kPinnedPositionVelocity;
  EXPECT_TRUE(idle(0, kHeld, kFree));
  EXPECT_FALSE(idle(1, kHeld, kFree)) << "frame 2 is free";
  EXPECT_FALSE(idle(0, End::kPinnedPosition, kFree));
  EXPECT_FALSE(idle(9, kHeld, kFree));
  EXPECT_TRUE(idle(9, kFree, kHeld));
  EXPECT_FALSE(idle(8, kFree, kHeld));
}

}  // namespace
}  // namespace limber::scene
