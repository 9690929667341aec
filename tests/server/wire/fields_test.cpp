#include "server/wire/fields.h"

#include <gtest/gtest.h>

#include "limber/v1/service.pb.h"

namespace limber::server {
namespace {

namespace proto = limber::v1;

TEST(Fields, MembersAreFoundByNameAndUnit) {
  proto::LinkageConditions conditions;
  conditions.add_angles();
  EXPECT_EQ(field_in(conditions, "pins[3].joint"), "pins[3].joint");
  EXPECT_EQ(field_in(conditions, "mean_angle"), "mean_angle_degrees");
  EXPECT_EQ(field_in(conditions, "angles[0].angle"), "angles[0].angle_degrees");
  EXPECT_EQ(field_in(conditions, "gravity"), "gravity");
  EXPECT_EQ(field_in(conditions, "segment_lengths[2]"), "segment_lengths[2]");
}

TEST(Fields, WhatIsNotInTheMessageStays) {
  proto::StartDesignRequest design;
  EXPECT_EQ(field_in(design, ""), "");
  EXPECT_EQ(field_in(design, "targets"), "targets");
  EXPECT_EQ(field_in(design, "start.flat"), "start.flat");
  EXPECT_EQ(field_in(design, "goal.else[2].that"), "goal.else[2].that");
  EXPECT_FALSE(find_field(design, "loads"));
  EXPECT_EQ(field_in(design, "[3"), "[3");
  EXPECT_EQ(field_in(design, "goal.targets[x].joint"), "goal.targets[x].joint");
}

TEST(Fields, OfSeveralThingsTheOneThatIsGiven) {
  proto::RodSection section;
  EXPECT_EQ(field_in(section, "width"), "") << "nothing is given";
  section.mutable_tube();
  EXPECT_EQ(field_in(section, "diameter"), "tube.diameter");
  EXPECT_EQ(field_in(section, "width"), "tube") << "as a whole";
  section.mutable_profile();
  EXPECT_EQ(field_in(section, "outer[2]"), "profile.outer[2]");
  EXPECT_EQ(field_in(section, "holes[1][0]"), "profile.holes[1][0]");
  proto::DesignSurface surface;
  surface.set_path("a.obj");
  EXPECT_EQ(field_in(surface, "triangles[3]"), "path");
  surface.mutable_triangles();
  EXPECT_EQ(field_in(surface, "triangles[3]"), "triangles.triangles[3]");
  EXPECT_EQ(field_in(surface, "vertices[3]"), "triangles.vertices[3]");
}

TEST(Fields, PlacesOfTargets) {
  proto::LinkageConditions conditions;
  conditions.add_targets()->mutable_segment();
  conditions.add_targets()->set_joint(1);
  EXPECT_EQ(field_in(conditions, "targets[0].segment"), "targets[0].segment.segment");
  EXPECT_EQ(field_in(conditions, "targets[0].share"), "targets[0].segment.share");
  EXPECT_EQ(field_in(conditions, "targets[1].joint"), "targets[1].joint");
  EXPECT_EQ(field_in(conditions, "targets[1]"), "targets[1]");
}

TEST(Fields, ListsInMessagesOfTheirOwn) {
  const proto::ChangeDesignRequest change;
  EXPECT_EQ(field_in(change, "targets[2].joint"), "targets.targets[2].joint");
  EXPECT_EQ(field_in(change, "targets"), "targets");
  EXPECT_EQ(field_in(change, "joint_surface_weights"), "joint_surface_weights.weights");
}

TEST(Fields, ErrorsAreRenamedAndKeepTheirLimits) {
  proto::LinkageConditions conditions;
  try {
    with_fields_of(conditions, "scene.",
                   [] { throw session::LimitError("mean_angle", "too many", 3, 4); });
    FAIL();
  } catch (const session::LimitError& error) {
    EXPECT_EQ(error.field(), "scene.mean_angle_degrees");
    EXPECT_EQ(error.limit(), 3u);
    EXPECT_EQ(error.value(), 4u);
  }
  try {
    with_fields_of(conditions, "scene.", [] { throw Error(ErrorCode::kIo, "", "why"); });
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.field(), "");
    EXPECT_STREQ(error.what(), "why");
  }
}

}  // namespace
}  // namespace limber::server
