#include "engine/session/bodies/change_steps.h"

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "engine/base/random.h"
#include "engine/session/bodies/keyframe_set.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session {
namespace {

using test::held;
using test::keyed;

ConstraintChange constraint_at(std::uint64_t id, const Eigen::Vector3d& target) {
  scene::Constraint constraint = held(3, 2, target);
  constraint.id = id;
  return {id, constraint};
}

TEST(ChangeSteps, NameTheOneThingTheyTouch) {
  EXPECT_EQ(touched_by(Change(ConstraintChange{4, std::nullopt})), (TouchedIds{4, 0}));
  EXPECT_EQ(touched_by(Change(TargetChange{5, {0, 0, 0}})), (TouchedIds{5, 0}));
  EXPECT_EQ(touched_by(Change(KeyframeChange{6, std::nullopt})), (TouchedIds{0, 6}));
  EXPECT_EQ(touched_by(Change(KeyframeShift{7, 1, 1})), (TouchedIds{0, 7}));
  EXPECT_EQ(touched_by(Change(EndsChange{})), TouchedIds{});
  EXPECT_EQ(touched_by(ChangeGroup{}), TouchedIds{});
  EXPECT_EQ(touched_by(ChangeGroup{TargetChange{5, {0, 0, 0}}, ConstraintChange{5, {}}}),
            (TouchedIds{5, 0}));
  EXPECT_EQ(touched_by(ChangeGroup{TargetChange{5, {0, 0, 0}}, TargetChange{6, {0, 0, 0}}}),
            TouchedIds{});
  // A constraint and a keyframe of the same number are two things.
  EXPECT_EQ(touched_by(ChangeGroup{TargetChange{5, {0, 0, 0}}, KeyframeShift{5, 1, 1}}),
            TouchedIds{});
}

TEST(MergedChanges, ADragComesToItsBeginning) {
  std::vector<Change> drag;
  for (const double x : {1.0, 2.0, 3.0}) drag.emplace_back(TargetChange{1, {x, 0, 0}});
  const ChangeGroup group = merged(drag);
  ASSERT_EQ(group.size(), 1u);
  EXPECT_EQ(std::get<TargetChange>(group[0]).target, Eigen::Vector3d(1, 0, 0));
}

TEST(MergedChanges, WhatWasMovedAndRemovedComesBackWhereItWas) {
  const ChangeGroup group =
      merged(std::vector<Change>{TargetChange{1, {1, 0, 0}}, constraint_at(1, {2, 0, 0})});
  ASSERT_EQ(group.size(), 1u);
  const auto& back = std::get<ConstraintChange>(group[0]);
  ASSERT_TRUE(back.value.has_value());
  EXPECT_EQ(back.value->target, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(back.value->frame, 3);
}

TEST(MergedChanges, WhatWasAddedAndMovedGoes) {
  const ChangeGroup group =
      merged(std::vector<Change>{ConstraintChange{1, {}}, TargetChange{1, {1, 0, 0}}});
  ASSERT_EQ(group.size(), 1u);
  EXPECT_FALSE(std::get<ConstraintChange>(group[0]).value.has_value());
}

TEST(MergedChanges, WhatCameAndWentHasNoValue) {
  const ChangeGroup group =
      merged(std::vector<Change>{KeyframeChange{2, {}}, KeyframeChange{2, keyed(4)}});
  ASSERT_EQ(group.size(), 1u);
  EXPECT_FALSE(std::get<KeyframeChange>(group[0]).value.has_value());
}

TEST(MergedChanges, OthersAreOneOfEachKind) {
  std::vector<Change> changes;  // one after another: lists of these trouble the compiler's warnings
  changes.emplace_back(EndsChange{scene::End::kFree, scene::End::kFree});
  changes.emplace_back(DynamicsChange{});
  changes.emplace_back(EndsChange{scene::End::kPinnedPosition, scene::End::kFree});
  changes.emplace_back(TargetChange{1, {1, 0, 0}});
  changes.emplace_back(KeyframeShift{1, 3, 4});
  const ChangeGroup group = merged(changes);
  ASSERT_EQ(group.size(), 4u);
  int ends = 0;
  for (const Change& change : group) {
    const auto* const one = std::get_if<EndsChange>(&change);
    if (one == nullptr) continue;
    ++ends;
    EXPECT_EQ(one->first, scene::End::kFree);
  }
  EXPECT_EQ(ends, 1);
  EXPECT_TRUE(merged(std::vector<Change>{}).empty());
}

/// Inverses of random changes, merged, do what all of them do one after another.
TEST(MergedChanges, TakeKeyframesBackAsAllOfThemWould) {
  Random random(8);
  for (int run = 0; run < 100; ++run) {
    scene::Scene scene = test::two_tets();
    scene.keyframes = {keyed(2, 0.1), keyed(3, 0.2), keyed(4, 0.3)};
    KeyframeSet set(scene);
    std::vector<Change> inverses;
    for (int step = 0; step < 12; ++step) {
      const auto id = static_cast<std::uint64_t>(1 + test::below(random, 5));
      const bool is_there = set.all().contains(id);
      if (is_there && test::below(random, 2) == 0) {
        KeyframeShift shift{id, test::below(random, 10), 1.0 + test::below(random, 9)};
        set.exchange(shift);
        inverses.emplace_back(shift);
      } else {
        KeyframeChange change{id, std::nullopt};
        if (!is_there || test::below(random, 2) == 0) {
          change.value = keyed(test::below(random, 10), 0.01 * step);
          change.value->id = id;
        }
        set.exchange(change);
        inverses.emplace_back(change);
      }
    }
    KeyframeSet by_steps = set, at_once = set;
    const auto apply = [](KeyframeSet& to, Change change) {
      if (auto* const value = std::get_if<KeyframeChange>(&change)) {
        if (value->value || to.all().contains(value->id)) to.exchange(*value);
      } else {
        to.exchange(std::get<KeyframeShift>(change));
      }
    };
    for (auto change = inverses.rbegin(); change != inverses.rend(); ++change)
      apply(by_steps, *change);
    const ChangeGroup group = merged(inverses);
    std::set<std::uint64_t> ids;
    for (const Change& change : group) {
      EXPECT_TRUE(ids.insert(touched_by(change).keyframe).second);
      apply(at_once, change);
    }
    const auto expected = by_steps.list(), found = at_once.list();
    ASSERT_EQ(found.size(), expected.size());
    ASSERT_EQ(found.size(), 3u);
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].id, expected[i].id);
      EXPECT_EQ(found[i].frame, expected[i].frame);
      EXPECT_EQ(found[i].weight, expected[i].weight);
      EXPECT_EQ(found[i].pose, expected[i].pose);
    }
  }
}

TEST(ChangeSteps, CountTheirBytesAndGoFromBothEnds) {
  const auto group_of = [](const Change& change) {
    return std::make_shared<const ChangeGroup>(ChangeGroup{change});
  };
  ConstraintChange three_nodes = constraint_at(1, {0, 0, 0});
  three_nodes.value->nodes = {0, 1, 2};
  ChangeSteps steps;
  EXPECT_TRUE(steps.empty());
  steps.push(group_of(TargetChange{1, {0, 0, 0}}), 11);
  steps.push(group_of(three_nodes), 12);
  steps.push(group_of(KeyframeChange{2, keyed(4)}), 13);
  EXPECT_EQ(steps.size(), 3u);
  EXPECT_EQ(steps.bytes(), 3 * sizeof(Change) + 3 * sizeof(int) + 18 * sizeof(double));
  EXPECT_EQ(steps.at_age(0).content, 13u);
  EXPECT_EQ(steps.at_age(2).content, 11u);
  EXPECT_EQ(steps.at_age(1).ids, (TouchedIds{1, 0}));

  steps.drop_oldest();
  EXPECT_EQ(steps.at_age(1).content, 12u);
  const ChangeSteps::Step newest = steps.pop_newest();
  EXPECT_EQ(newest.content, 13u);
  EXPECT_EQ(newest.ids, (TouchedIds{0, 2}));
  EXPECT_EQ(steps.bytes(), sizeof(Change) + 3 * sizeof(int));
  steps.clear();
  EXPECT_TRUE(steps.empty());
  EXPECT_EQ(steps.bytes(), 0u);
}

}  // namespace
}  // namespace limber::session
