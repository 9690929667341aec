// Checkpoints of sessions of all kinds between messages and values.
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "server/kinds/beams/checkpoint.h"
#include "server/kinds/beams/scenes.h"
#include "server/kinds/beams/structure.h"
#include "server/kinds/bodies/checkpoint.h"
#include "server/kinds/bodies/scene.h"
#include "server/kinds/linkages/checkpoint.h"
#include "server/wire/errors.h"
#include "tests/server/support/scenes.h"

namespace limber::server {
namespace {

using namespace limber::server::testing;
using session::Redo;
using session::Undo;
using session::Whose;

constexpr double kTilt = 0.3;  // [rad], of what rounds

struct Bodies {
  using Document = session::Document;
  using Edit = session::BodyEdit;

  static Document open() {
    return Document(decode_scene(small_scene(), "", {},
                                 {[](const auto&, const auto&) { return LoadedMesh(); }, {}, {}})
                        .scene);
  }
  static void apply(Document& document, const std::vector<Edit>& edits,
                    const session::Author& author) {
    session::Touched touched;
    (void)document.apply(edits, std::nullopt, touched, author);
  }
  static proto::StoredBody encode(const Document& document) {
    return encode_body_checkpoint(document.checkpoint());
  }
  static Document::Checkpoint decode(const proto::StoredBody& message) {
    return decode_body_checkpoint(message, 7);
  }
  /// Of the pins of small_scene(), aside by x.
  static session::PinPaths paths(double x) {
    const Document document = open();
    const scene::Scene& scene = *document.unedited();
    const Eigen::VectorXd rest = scene.mesh.nodes(Eigen::all, scene.fixed_nodes).reshaped();
    return std::make_shared<const Eigen::MatrixXd>(
        (rest.array() + x).matrix().replicate(1, scene.frame_count));
  }
  static Edit random_edit(std::mt19937& random) {
    const int frame = static_cast<int>(1 + random() % 18);
    const double x = 0.1 * static_cast<double>(random() % 97) / 7;
    const std::uint64_t id = 1 + random() % 6;
    scene::Constraint constraint;
    constraint.frame = frame;
    constraint.nodes = {static_cast<int>(4 + random() % 20), 27};
    constraint.axes = 1 + static_cast<unsigned>(random() % 7);
    constraint.target = {0.01, x, 0};
    if (random() % 3 == 0) constraint.weight = std::numeric_limits<double>::infinity();
    scene::Keyframe keyframe;
    keyframe.frame = frame;
    keyframe.pose = std::make_shared<const Eigen::VectorXd>(Eigen::VectorXd::Constant(84, x / 3));
    switch (random() % 11) {
      case 0:
      case 1:
        return session::AddConstraint{constraint};
      case 2:
        return session::RemoveConstraint{id};
      case 3:
        constraint.id = id;
        return session::ReplaceConstraint{constraint};
      case 4:
        return session::SetEnds{scene::End::kFree,
                                frame % 2 == 0 ? scene::End::kPinnedPosition : scene::End::kFree};
      case 5:
        return session::SetDynamics{{24 + x, 30, 0.01 * x}};
      case 6:
        if (frame % 2 == 0) return session::ResetMaterial{};
        return session::SetMaterialVariables{scene::MaterialVariables::kDynamics};
      case 7:
        if (frame % 3 == 0) return session::RemoveKeyframe{id};
        if (frame % 3 == 1) return session::MoveKeyframe{id, frame, 3 + x};
        return session::AddKeyframe{keyframe};
      case 8:
        if (frame % 3 == 0) return session::SetPins{};
        return session::SetPins{paths(x)};
      default:
        return session::MoveConstraint{id, {x, 0, 1}};
    }
  }
};

struct Linkages {
  using Document = session::LinkageDocument;
  using Edit = session::LinkageEdit;
  static constexpr int kJoints = 9, kSegments = 12;

  static Document open() { return {scene::LinkageConditions(), kJoints, kSegments}; }
  static void apply(Document& document, const std::vector<Edit>& edits,
                    const session::Author& author) {
    (void)document.apply(edits, std::nullopt, author);
  }
  static proto::StoredLinkage encode(const Document& document) {
    return encode_linkage_checkpoint(document.checkpoint());
  }
  static Document::Checkpoint decode(const proto::StoredLinkage& message) {
    return decode_linkage_checkpoint(message, 7);
  }
  static Edit random_edit(std::mt19937& random) {
    const int joint = static_cast<int>(random() % kJoints);
    const double x = static_cast<double>(random() % 97) / 7;
    scene::LinkageTarget target;
    target.joint = joint;
    target.position = {x, 0, 1 / (1 + x)};
    target.stiffness = 10;
    scene::JointLoad load;
    load.joint = joint;
    load.force = {0, 0, x - 3};
    switch (random() % 9) {
      case 0:
        return session::PinJoint{joint, scene::Held::kMotion};
      case 1:
        return session::PinJoint{joint, scene::Held::kMotionAndAngle, Eigen::Vector3d(x, 1, 0)};
      case 2:  // degrees, as edits have them
        return session::SetJointAngle{joint, 3.7 * x * 3.14159265358979 / 180};
      case 3:
        return session::SetMeanAngle{0.01 * x};
      case 4:
        return session::AddTarget{target};
      case 5:
        return session::MoveTarget{1 + random() % 4, {x, x, 0}};
      case 6:
        return session::SetSegmentLengths{Eigen::VectorXd::Constant(kSegments, 1 + x)};
      case 7: {
        scene::LinkageErection erection;
        erection.mean_angle = 0.1 + kTilt * 0.01 * x;
        erection.push = {load};
        return session::SetErection{std::make_shared<const scene::LinkageErection>(erection)};
      }
      default:
        return session::SetJointLoad{load};
    }
  }
};

struct Beams {
  using Document = session::BeamDocument;
  using Edit = session::BeamEdit;
  static constexpr int kNodes = 8;

  struct NoPlaces final : Document::Places {
    [[nodiscard]] beams::PrescribedMotion of(int) const override {
      throw Error(ErrorCode::kFailedPrecondition, "node", "not here");
    }
  };
  static Document open() {
    beams::BeamModel model;
    for (int i = 0; i < kNodes; ++i) {
      beams::BeamNode node;
      node.position = {0.5 * i, 0, 0};
      model.nodes.push_back(node);
    }
    model.sections = {decode_beam_structure(beam_sample_scene("arch").beams().structure(), "s")
                          .model.sections.front()};
    for (int i = 0; i + 1 < kNodes; ++i) {
      beams::BeamElement element;
      element.start = i;
      element.finish = i + 1;
      model.elements.push_back(element);
    }
    beams::BeamSupport clamp;
    clamp.node = 0;
    clamp.fixed = {true, true, true, true, true, true};
    model.supports = {clamp};
    return Document(model);
  }
  static void apply(Document& document, const std::vector<Edit>& edits,
                    const session::Author& author) {
    (void)document.apply(edits, std::nullopt, NoPlaces(), author);
  }
  static proto::StoredBeams encode(const Document& document) {
    return encode_beam_checkpoint(document.checkpoint());
  }
  static Document::Checkpoint decode(const proto::StoredBeams& message) {
    return decode_beam_checkpoint(message, 7);
  }
  static Edit random_edit(std::mt19937& random) {
    const int node = 1 + static_cast<int>(random() % (kNodes - 1));
    const double x = static_cast<double>(random() % 97) / 7;
    const beams::NodalLoad load{node, {x, 0, -1}, {0, x, 0}, beams::LoadDirection::kFollowing};
    proto::BeamSupport oblique;  // axes that are rounded when they are read
    oblique.set_node(static_cast<std::uint32_t>(node));
    oblique.set_fix_x(true);
    oblique.mutable_x_axis()->set_x(1);
    oblique.mutable_x_axis()->set_y(x);
    oblique.mutable_y_axis()->set_y(1);
    oblique.mutable_y_axis()->set_z(0.3);
    beams::PrescribedMotion motion;
    motion.node = node;
    motion.translates = {true, false, true};
    motion.translation = {0.01 * x, 0, 0.02};
    switch (random() % 7) {
      case 0:
        return session::SetSupport{decode_support(oblique, "support")};
      case 1:
        return session::MoveNode{motion};
      case 2:
        return session::ReleaseNode{node};
      case 3:
        return session::SetElementLoad{{node - 1, {0, 0, -x}}};
      case 4:
        return session::PushNode{load};
      case 5:
        return session::SetGravity{{0, 0, -x}};
      default:
        return session::SetNodeLoad{load};
    }
  }
};

template <class Kind>
typename Kind::Edit next_edit(std::mt19937& random) {
  const Whose whose = random() % 2 == 0 ? Whose::kOwn : Whose::kAnyone;
  switch (random() % 8) {
    case 0:
      return Undo{whose};
    case 1:
      return Redo{whose};
    default:
      return Kind::random_edit(random);
  }
}

/// A request of some edits; many are refused. @returns what was said to it
template <class Kind>
std::string edit(typename Kind::Document& document, std::mt19937& random) {
  std::vector<typename Kind::Edit> edits;
  const auto count = 1 + random() % 3;
  for (unsigned i = 0; i < count; ++i) edits.push_back(next_edit<Kind>(random));
  try {
    Kind::apply(document, edits, random() % 2 == 0 ? "one" : "other");
    return "made";
  } catch (const Error& error) {
    return error.field() + ": " + error.what();
  }
}

template <class Kind>
class ServerCheckpoints : public ::testing::Test {};
using KindsWithCheckpoints = ::testing::Types<Bodies, Linkages, Beams>;
TYPED_TEST_SUITE(ServerCheckpoints, KindsWithCheckpoints);

TYPED_TEST(ServerCheckpoints, WhatIsReadIsWhatWasWrittenAndContinuesAlike) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    auto document = TypeParam::open();
    for (int i = 0; i < 150; ++i) (void)edit<TypeParam>(document, random);
    const auto message = TypeParam::encode(document);
    auto later = TypeParam::open();
    auto checkpoint = TypeParam::decode(message);
    later.demand_reachable(checkpoint);
    later.begin_at(std::move(checkpoint));
    ASSERT_EQ(TypeParam::encode(later).SerializeAsString(), message.SerializeAsString());
    EXPECT_EQ(later.revision(), 7U);
    EXPECT_GT(later.undo_count(), 20U);
    std::mt19937 same = random;
    for (int i = 0; i < 150; ++i)
      ASSERT_EQ(edit<TypeParam>(document, random), edit<TypeParam>(later, same)) << i;
    EXPECT_EQ(TypeParam::encode(later).SerializeAsString(),
              TypeParam::encode(document).SerializeAsString());
  }
}

TYPED_TEST(ServerCheckpoints, ADragTakesLittleRoom) {
  std::mt19937 random(1);
  auto document = TypeParam::open();
  for (int i = 0; i < 300; ++i) (void)edit<TypeParam>(document, random);
  for (int i = 0; i < 2000 && document.undo_count() < 1000; ++i)
    (void)edit<TypeParam>(document, random);
  const std::size_t bytes = TypeParam::encode(document).ByteSizeLong();
  EXPECT_LT(bytes, 300U * document.undo_count() + 100'000U);
}

/// @returns the field that is refused; empty: none
template <class Kind, class Message>
std::string refused_field(const Message& message) {
  try {
    Kind::open().demand_reachable(Kind::decode(message));
    return "";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.field();
  }
}

template <class Kind>
auto edited(int edits) {
  std::mt19937 random(5);
  auto document = Kind::open();
  for (int i = 0; i < edits; ++i) (void)edit<Kind>(document, random);
  return Kind::encode(document);
}

/// Documents would give them again, to something else.
TEST(ServerCheckpointsOfBodies, NumbersThatWereNotGivenAreRefused) {
  const proto::StoredBody sound = edited<Bodies>(150);
  ASSERT_EQ(refused_field<Bodies>(sound), "");
  for (const char* counter :
       {"next_constraint", "next_keyframe", "last_content", "last_epoch", "last_number"}) {
    proto::StoredBody message = sound;
    const auto* field = message.GetDescriptor()->FindFieldByName(counter);
    ASSERT_GT(message.GetReflection()->GetUInt64(message, field), 1U) << counter;
    message.GetReflection()->SetUInt64(&message, field, 1);
    EXPECT_EQ(refused_field<Bodies>(message), counter);
  }
}

session::BodyEdit constraint_of(std::uint64_t id) {
  scene::Constraint constraint;
  constraint.id = id;
  constraint.frame = 5;
  constraint.nodes = {27};
  return session::AddConstraint{constraint};
}

session::BodyEdit keyframe_of(std::uint64_t id, int frame) {
  scene::Keyframe keyframe;
  keyframe.id = id;
  keyframe.frame = frame;
  keyframe.pose = std::make_shared<const Eigen::VectorXd>(Eigen::VectorXd::Zero(84));
  return session::AddKeyframe{keyframe};
}

/// Earlier servers took any id: with the largest the count goes round.
TEST(ServerCheckpointsOfBodies, IdsThatClientsOnceChoseStay) {
  constexpr std::uint64_t kOnes = ~std::uint64_t{0};
  for (const std::uint64_t id : {std::uint64_t{1} << 60U, kOnes}) {
    auto document = Bodies::open();
    Bodies::apply(document, {constraint_of(id), keyframe_of(id, 3)}, {});
    EXPECT_EQ(refused_field<Bodies>(Bodies::encode(document)), "") << id;
    Bodies::apply(document, {constraint_of(0), keyframe_of(0, 4)}, {});
    const proto::StoredBody message = Bodies::encode(document);
    ASSERT_EQ(refused_field<Bodies>(message), "") << id;
    auto later = Bodies::open();
    later.begin_at(Bodies::decode(message));
    for (auto* one : {&document, &later}) Bodies::apply(*one, {constraint_of(0)}, {});
    EXPECT_EQ(later.constraint_list().size(), 3U + Bodies::open().constraint_list().size());
    EXPECT_EQ(Bodies::encode(later).next_constraint(), Bodies::encode(document).next_constraint());
  }
  auto removed = Bodies::open();
  Bodies::apply(removed, {constraint_of(kOnes), session::RemoveConstraint{kOnes}}, {});
  EXPECT_EQ(refused_field<Bodies>(Bodies::encode(removed)), "");
}

TEST(ServerCheckpointsOfLinkages, NumbersThatWereNotGivenAreRefused) {
  proto::StoredLinkage message = edited<Linkages>(150);
  ASSERT_EQ(refused_field<Linkages>(message), "");
  message.set_last_target(message.last_target() - 1);
  EXPECT_EQ(refused_field<Linkages>(message), "last_target");
  message = edited<Linkages>(150);
  message.mutable_history()->set_last_number(1);
  EXPECT_EQ(refused_field<Linkages>(message), "last_number");
}

TEST(ServerCheckpointsOfBeams, NumbersThatWereNotGivenAreRefused) {
  proto::StoredBeams message = edited<Beams>(150);
  ASSERT_EQ(refused_field<Beams>(message), "");
  message.mutable_history()->set_last_number(1);
  EXPECT_EQ(refused_field<Beams>(message), "last_number");
}

/// What comes from a file that somebody made is refused, or leads to a document that works.
TYPED_TEST(ServerCheckpoints, DamagedOnesAreRefusedOrSound) {
  std::mt19937 random(3);
  auto document = TypeParam::open();
  for (int i = 0; i < 60; ++i) (void)edit<TypeParam>(document, random);
  const std::string sound = TypeParam::encode(document).SerializeAsString();
  int read = 0, refused = 0;
  for (int i = 0; i < 800; ++i) {
    std::string bytes = sound;
    for (unsigned k = 0; k <= random() % 3; ++k)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    auto message = TypeParam::encode(document);
    if (!message.ParseFromString(bytes)) continue;
    auto later = TypeParam::open();
    try {
      auto checkpoint = TypeParam::decode(message);
      later.demand_reachable(checkpoint);
      later.begin_at(std::move(checkpoint));
      ++read;
    } catch (const Error&) {
      ++refused;
      continue;
    } catch (const Refusal&) {
      ++refused;
      continue;
    }
    const auto all = [&](const typename TypeParam::Edit& turn) {
      for (int steps = 0; steps < 200; ++steps) {
        try {
          TypeParam::apply(later, {turn}, "");
        } catch (const Error&) {
          return;
        }
      }
    };
    all(Redo{Whose::kAnyone});
    all(Undo{Whose::kAnyone});
    all(Redo{Whose::kAnyone});
    for (int k = 0; k < 3; ++k) (void)edit<TypeParam>(later, random);
  }
  EXPECT_GT(read, 20);
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace limber::server
