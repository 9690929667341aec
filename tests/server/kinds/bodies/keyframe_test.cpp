#include "server/kinds/bodies/keyframe.h"

#include <gmock/gmock.h>

#include <cmath>

#include "server/kinds/bodies/edit.h"
#include "server/kinds/bodies/field_paths.h"
#include "server/wire/fields.h"
#include "tests/server/support/scenes.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;

bodies::NodePositions rest() {
  bodies::NodePositions nodes(3, 4);
  nodes << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  return nodes;
}

/// Knows one file, `moved`: the rest shape moved by (1, 2, 3), and `few`, without the last node.
LoadedMesh load(const proto::MeshSource& source, const std::string& field) {
  const std::string name = source.has_path() ? source.path() : source.file().name();
  LoadedMesh loaded;
  loaded.mesh.nodes = rest().colwise() + Eigen::Vector3d(1, 2, 3);
  if (name == "few") loaded.mesh.nodes.conservativeResize(3, 3);
  if (name == "none") throw invalid(field + (source.has_path() ? ".path" : ".file"), "no file");
  return loaded;
}

proto::Keyframe positions(double shift) {
  proto::Keyframe message;
  message.set_frame(7);
  scene::Keyframe keyframe;
  keyframe.pose = std::make_shared<const Eigen::VectorXd>(Eigen::VectorXd::Constant(12, shift));
  *message.mutable_positions() = encode_pose(keyframe, rest());
  return message;
}

scene::Keyframe decode_alone(const proto::Keyframe& message,
                             const bodies::NodePositions& nodes = rest()) {
  Faults faults(Faults::Mode::kThrow);
  return decode_keyframe(message, "k", nodes, load, faults);
}

std::string field_of(const proto::Keyframe& message) {
  try {
    (void)decode_alone(message);
  } catch (const Refusal& refusal) {
    return refusal.field();
  }
  return "accepted";
}

TEST(KeyframeCodec, PosesBecomeDisplacements) {
  scene::Keyframe keyframe = decode_alone(positions(0.25));
  EXPECT_EQ(keyframe.frame, 7);
  EXPECT_EQ(keyframe.weight, 100);
  ASSERT_EQ(keyframe.pose->size(), 12);
  EXPECT_DOUBLE_EQ((*keyframe.pose)[5], 0.25);
  proto::Keyframe named;
  named.set_path("moved");
  named.set_exact(true);
  keyframe = decode_alone(named);
  EXPECT_TRUE(std::isinf(keyframe.weight));
  EXPECT_EQ(keyframe.pose->segment<3>(9), Eigen::Vector3d(1, 2, 3));
  named.mutable_file()->set_name("moved");
  named.set_weight(3);
  keyframe = decode_alone(named);
  EXPECT_EQ(keyframe.weight, 3);
  EXPECT_EQ(keyframe.pose->segment<3>(0), Eigen::Vector3d(1, 2, 3));
}

TEST(KeyframeCodec, WhatIsWrongIsNamed) {
  proto::Keyframe message;
  EXPECT_EQ(field_of(message), "k.positions");
  message = positions(0);
  message.mutable_positions()->set_shape(0, 5);
  EXPECT_EQ(field_of(message), "k.positions.data");
  message.set_path("few");
  EXPECT_EQ(field_of(message), "k.path");
  message.set_path("none");
  EXPECT_EQ(field_of(message), "k.path");
  message.mutable_file()->set_name("few");
  EXPECT_EQ(field_of(message), "k.file");
  message = positions(0);
  message.set_frame(1u << 31);
  EXPECT_EQ(field_of(message), "k.frame");
}

TEST(KeyframeCodec, AllThatIsWrongIsCollectedAndHasADefault) {
  proto::Keyframe message;
  message.set_frame(1u << 31);
  Faults faults(Faults::Mode::kCollect);
  const scene::Keyframe keyframe = decode_keyframe(message, "k", rest(), load, faults);
  EXPECT_EQ(faults.found().size(), 2u);
  EXPECT_EQ(*keyframe.pose, Eigen::VectorXd::Zero(12));
  // Without a mesh, sizes are not reported.
  EXPECT_EQ(decode_alone(positions(0), bodies::NodePositions(3, 0)).pose->size(), 0);
}

TEST(KeyframeCodec, ComesBackWithAndWithoutItsPose) {
  for (const bool exact : {false, true}) {
    proto::Keyframe message = positions(0.5);
    message.set_id(9);
    if (exact) {
      message.set_exact(true);
    } else {
      message.set_weight(2);
    }
    const scene::Keyframe keyframe = decode_alone(message);
    proto::Keyframe again = encode_keyframe(keyframe);
    EXPECT_EQ(again.pose_case(), proto::Keyframe::POSE_NOT_SET);
    *again.mutable_positions() = encode_pose(keyframe, rest());
    EXPECT_EQ(again.SerializeAsString(), message.SerializeAsString());
  }
}

TEST(KeyframeCodec, Edits) {
  proto::EditRequest request;
  *request.add_edits()->mutable_add_keyframe()->mutable_keyframe() = positions(1);
  auto* move = request.add_edits()->mutable_move_keyframe();
  move->set_id(3);
  move->set_frame(0);
  request.add_edits()->mutable_move_keyframe()->set_exact(true);
  request.add_edits()->mutable_remove_keyframe()->set_id(4);
  scene::Scene scene;
  scene.mesh.nodes = rest();
  const auto edits = decode_edits(request, scene, load);
  EXPECT_EQ(std::get<session::AddKeyframe>(edits[0]).keyframe.frame, 7);
  EXPECT_EQ(std::get<session::MoveKeyframe>(edits[1]).frame, 0);
  EXPECT_FALSE(std::get<session::MoveKeyframe>(edits[1]).weight.has_value());
  EXPECT_FALSE(std::get<session::MoveKeyframe>(edits[2]).frame.has_value());
  EXPECT_TRUE(std::isinf(*std::get<session::MoveKeyframe>(edits[2]).weight));
  EXPECT_EQ(std::get<session::RemoveKeyframe>(edits[3]).id, 4u);
  EXPECT_EQ(field_in(request, "edits[0].add_keyframe.keyframe.pose"),
            "edits[0].add_keyframe.keyframe.positions");
  const auto field = [&](const auto& change) {
    proto::EditRequest one;
    change(*one.add_edits());
    try {
      (void)decode_edits(one, scene, load);
    } catch (const Refusal& refusal) {
      return refusal.field();
    }
    return std::string("accepted");
  };
  EXPECT_EQ(field([](auto& edit) { edit.mutable_add_keyframe(); }),
            "edits[0].add_keyframe.keyframe");
  EXPECT_EQ(field([](auto& edit) { edit.mutable_move_keyframe()->set_id(1); }),
            "edits[0].move_keyframe");
  EXPECT_EQ(field([](auto& edit) { edit.mutable_move_keyframe()->set_exact(false); }),
            "edits[0].move_keyframe.exact");
}

TEST(KeyframeCodec, APosesFieldIsWhatTheClientCalledIt) {
  proto::Scene scene;
  *scene.add_keyframes() = positions(0);
  scene.add_keyframes()->set_path("moved");
  scene.add_keyframes()->mutable_file();
  EXPECT_EQ(body_field_in(scene, {}, "keyframes[0].pose"), "keyframes[0].positions");
  EXPECT_EQ(body_field_in(scene, {}, "keyframes[1].pose"), "keyframes[1].path");
  EXPECT_EQ(body_field_in(scene, {}, "keyframes[2].pose"), "keyframes[2].file");
  EXPECT_EQ(body_field_in(scene, {}, "keyframes[2].frame"), "keyframes[2].frame");
}

}  // namespace
}  // namespace limber::server
