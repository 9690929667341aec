#include "engine/session/bodies/keyframe_set.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "engine/base/error.h"
#include "engine/session/core/limit_error.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

using test::keyed;
using test::two_tets;

scene::Keyframe keyed_as(std::uint64_t id, int frame, double value = 0) {
  scene::Keyframe keyframe = keyed(frame, value);
  keyframe.id = id;
  return keyframe;
}

KeyframeSet set_of(const std::vector<scene::Keyframe>& keyframes) {
  scene::Scene scene = two_tets();
  scene.keyframes = keyframes;
  return KeyframeSet(scene);
}

/// "id:frame" of each.
std::string listed(const KeyframeSet& set) {
  std::string all;
  for (const scene::Keyframe& keyframe : set.list())
    all += std::to_string(keyframe.id) + ":" + std::to_string(keyframe.frame) + " ";
  return all;
}

std::string refused_keyframe(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.field() + " " + to_string(error.code());
  }
  return "accepted";
}

const std::string kTaken = to_string(ErrorCode::kAlreadyExists);
const std::string kUnknown = to_string(ErrorCode::kNotFound);

TEST(KeyframeSet, NumbersWhatHasNoNumberBehindAllThatHave) {
  const KeyframeSet set = set_of({keyed(4), keyed_as(7, 2), keyed_as(3, 5), keyed(6)});
  EXPECT_EQ(listed(set), "3:5 7:2 8:4 9:6 ");
  EXPECT_EQ(set.next_id(), 10u);
  EXPECT_EQ(set_of({}).next_id(), 1u);
}

TEST(KeyframeSet, ASceneWithTwoInAFrameIsRefused) {
  const std::string refused = refused_keyframe([] { (void)set_of({keyed(4), keyed(4)}); });
  EXPECT_EQ(refused.find("keyframes[1].frame"), 0u) << refused;
}

TEST(KeyframeSet, AnAddedOneIsNumberedBeforeItIsThere) {
  KeyframeSet set = set_of({keyed(4)});
  KeyframeChange first = set.added(keyed(5));
  EXPECT_EQ(first.id, 2u);
  EXPECT_EQ(listed(set), "1:4 ");
  EXPECT_EQ(set.added(keyed(5)).id, 3u);  // numbers are not given twice
  EXPECT_EQ(set.added(keyed_as(20, 6)).id, 20u);
  EXPECT_EQ(set.next_id(), 21u);
  EXPECT_EQ(set.added(keyed_as(9, 6)).id, 9u);
  EXPECT_EQ(set.next_id(), 21u);
  set.set_next_id(2);
  EXPECT_EQ(set.added(keyed(5)).id, 2u);
}

TEST(KeyframeSet, BehindTheGreatestNumberComesTheFirstFreeOne) {
  const std::uint64_t greatest = std::numeric_limits<std::uint64_t>::max();
  KeyframeSet set = set_of({keyed_as(1, 4)});
  KeyframeChange change = set.added(keyed_as(greatest, 5));
  set.exchange(change);
  EXPECT_EQ(set.added(keyed(6)).id, 2u);
}

TEST(KeyframeSet, WhatCannotBeAddedIsNamed) {
  KeyframeSet set = set_of({keyed_as(1, 4)});
  const auto of = [&](const scene::Keyframe& keyframe) {
    return refused_keyframe([&] { (void)set.added(keyframe); });
  };
  EXPECT_EQ(of(keyed(4)), "keyframe.frame " + kTaken);
  EXPECT_EQ(of(keyed_as(1, 5)), "keyframe.id " + kTaken);
  EXPECT_EQ(of(keyed(10)).find("keyframe.frame "), 0u);
  scene::Keyframe weightless = keyed(5);
  weightless.weight = 0;
  EXPECT_EQ(of(weightless).find("keyframe.weight "), 0u);
  scene::Keyframe short_pose = keyed(5);
  short_pose.pose = std::make_shared<const Eigen::VectorXd>(Eigen::VectorXd::Zero(15));
  EXPECT_EQ(of(short_pose).find("keyframe.pose "), 0u);
  EXPECT_EQ(set.next_id(), 2u);
}

TEST(KeyframeSet, MoreThanTheLimitAreRefusedInNumbers) {
  scene::Scene scene = two_tets();
  scene.frame_count = scene::kMaxKeyframes + 10;
  for (int i = 0; i < scene::kMaxKeyframes; ++i) scene.keyframes.push_back(keyed(i + 2));
  KeyframeSet set(scene);
  try {
    (void)set.added(keyed(scene::kMaxKeyframes + 3));
    ADD_FAILURE() << "one too many was accepted";
  } catch (const LimitError& error) {
    EXPECT_EQ(error.field(), "keyframe");
    EXPECT_EQ(error.limit(), static_cast<std::uint64_t>(scene::kMaxKeyframes));
    EXPECT_EQ(error.value(), error.limit() + 1);
  }
}

TEST(KeyframeSet, MovesKeepWhatTheyDoNotName) {
  const KeyframeSet set = set_of({keyed_as(1, 4), keyed_as(2, 6)});
  const KeyframeShift frame = set.moved({1, 5, std::nullopt});
  EXPECT_EQ(frame.frame, 5);
  EXPECT_EQ(frame.weight, 100);
  const KeyframeShift weight = set.moved({1, std::nullopt, 7.0});
  EXPECT_EQ(weight.frame, 4);
  EXPECT_EQ(weight.weight, 7);
  EXPECT_EQ(set.moved({1, 4, std::nullopt}).frame, 4);  // its own frame is not taken
  EXPECT_EQ(refused_keyframe([&] { (void)set.moved({1, 6, std::nullopt}); }), "frame " + kTaken);
  EXPECT_EQ(refused_keyframe([&] { (void)set.moved({3, 5, std::nullopt}); }), "id " + kUnknown);
  EXPECT_EQ(refused_keyframe([&] { (void)set.moved({1, -1, std::nullopt}); }).find("frame "), 0u);
  EXPECT_EQ(refused_keyframe([&] {
              (void)set.moved({1, std::nullopt, -1.0});
            }).find("weight "),
            0u);
  EXPECT_EQ(refused_keyframe([&] { (void)set.removed(3); }), "id " + kUnknown);
}

TEST(KeyframeSet, AChangeBecomesItsInverseAndPosesAreShared) {
  KeyframeSet set = set_of({keyed_as(1, 4, 0.5)});
  const auto* const pose = set.all().at(1).pose.get();
  KeyframeChange removal = set.removed(1);
  set.exchange(removal);
  EXPECT_EQ(listed(set), "");
  set.exchange(removal);
  EXPECT_EQ(listed(set), "1:4 ");
  EXPECT_EQ(set.all().at(1).pose.get(), pose);
  EXPECT_FALSE(removal.value.has_value());

  KeyframeChange addition = set.added(keyed(7));
  set.exchange(addition);
  EXPECT_EQ(listed(set), "1:4 2:7 ");
  set.exchange(addition);
  EXPECT_EQ(listed(set), "1:4 ");

  KeyframeChange replacement{1, keyed_as(1, 8)};
  set.exchange(replacement);
  EXPECT_EQ(listed(set), "1:8 ");
  set.exchange(replacement);
  EXPECT_EQ(listed(set), "1:4 ");

  KeyframeShift shift = set.moved({1, 2, 3.0});
  set.exchange(shift);
  EXPECT_EQ(set.all().at(1).frame, 2);
  EXPECT_EQ(set.all().at(1).weight, 3);
  EXPECT_EQ(shift.frame, 4);
  EXPECT_EQ(shift.weight, 100);
}

TEST(KeyframeSet, ACopyHandsOverWhatWasEdited) {
  KeyframeSet set = set_of({keyed(4)});
  KeyframeSet copy = set;
  KeyframeChange addition = copy.added(keyed(5));
  copy.exchange(addition);
  set.exchange_edited(copy);
  EXPECT_EQ(listed(set), "1:4 2:5 ");
  EXPECT_EQ(set.next_id(), 3u);
  EXPECT_EQ(listed(copy), "1:4 ");
  EXPECT_EQ(copy.next_id(), 2u);
}

}  // namespace
}  // namespace limber::session
