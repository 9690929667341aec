#include "server/kinds/bodies/field_paths.h"

#include <gtest/gtest.h>

#include "server/wire/fields.h"
#include "tests/server/support/scenes.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

TEST(FieldPaths, ATargetIsWhatTheClientCalledIt) {
  proto::Scene scene = small_scene();
  *scene.add_constraints() = scene.constraints(0);
  scene.mutable_constraints(1)->mutable_position()->set_x(1);
  EXPECT_EQ(body_field_in(scene, {}, "constraints[0].target"), "constraints[0].displacement");
  EXPECT_EQ(body_field_in(scene, {}, "constraints[1].target"), "constraints[1].position");
  EXPECT_EQ(body_field_in(scene, {}, "constraints[1].frame"), "constraints[1].frame");
  EXPECT_EQ(body_field_in(scene, {}, "constraints[2].target"), "constraints[2].target");
  proto::EditRequest edits;
  edits.add_edits()->mutable_move();
  *edits.add_edits()->mutable_add()->mutable_constraint() = scene.constraints(1);
  *edits.add_edits()->mutable_replace()->mutable_constraint() = scene.constraints(0);
  EXPECT_EQ(field_in(edits, "edits[0].move.target"), "edits[0].move.target");
  EXPECT_EQ(field_in(edits, "edits[1].add.constraint.target"), "edits[1].add.constraint.position");
  EXPECT_EQ(field_in(edits, "edits[2].replace.constraint.target"),
            "edits[2].replace.constraint.displacement");
  edits.add_edits()->mutable_add()->mutable_constraint()->mutable_velocity();
  EXPECT_EQ(field_in(edits, "edits[3].add.constraint.target"), "edits[3].add.constraint.velocity");
  EXPECT_EQ(field_in(edits, "expected_revision"), "expected_revision");
}

TEST(FieldPaths, MaterialsOfGroups) {
  proto::Scene message = small_scene();
  scene::Scene scene;
  scene.mesh.materials.resize(3);
  EXPECT_EQ(body_field_in(message, scene, "mesh.materials[1].density"),
            "mesh.materials[1].density");
  message.add_material_groups();
  message.add_material_groups();
  EXPECT_EQ(body_field_in(message, scene, "mesh.materials[0].density"), "material.density");
  EXPECT_EQ(body_field_in(message, scene, "mesh.materials[1].density"),
            "material_groups[0].material.density");
  EXPECT_EQ(body_field_in(message, scene, "mesh.materials[2].poissons_ratio"),
            "material_groups[1].material.poissons_ratio");
}

}  // namespace
}  // namespace limber::server
