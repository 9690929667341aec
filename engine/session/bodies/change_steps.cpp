#include "engine/session/bodies/change_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <variant>

#include "engine/base/error.h"
#include "engine/scene/embedding/surface_points.h"

namespace limber::session {
namespace {

std::size_t bytes_of_group(const ChangeGroup& group) {
  std::size_t bytes = group.size() * sizeof(Change);
  for (const Change& change : group) {
    const auto* constraint = std::get_if<ConstraintChange>(&change);
    if (constraint != nullptr && constraint->value)
      bytes += scene::node_count_of(*constraint->value) * sizeof(int) +
               constraint->value->path.size() * sizeof(scene::PathKey);
    const auto* keyframe = std::get_if<KeyframeChange>(&change);
    if (keyframe != nullptr && keyframe->value)
      bytes += static_cast<std::size_t>(keyframe->value->pose->size()) * sizeof(double);
    const auto* pins = std::get_if<PinsChange>(&change);
    if (pins != nullptr && pins->paths)
      bytes += static_cast<std::size_t>(pins->paths->size()) * sizeof(double);
  }
  return bytes;
}

/// The object of a change: a constraint, a keyframe, or one of the single values.
using Thing = std::pair<std::size_t, std::uint64_t>;
constexpr std::size_t kConstraint = 0, kKeyframe = 1, kOthers = 2;

Thing thing_of(const Change& change) {
  const TouchedIds ids = touched_by(change);
  if (std::holds_alternative<ConstraintChange>(change) ||
      std::holds_alternative<TargetChange>(change))
    return {kConstraint, ids.constraint};
  if (std::holds_alternative<KeyframeChange>(change) ||
      std::holds_alternative<KeyframeShift>(change))
    return {kKeyframe, ids.keyframe};
  return {kOthers + change.index(), 0};
}

/// `later` followed by `change`, both of one thing.
void follow_by(Change& later, const Change& change) {
  auto* const constraint = std::get_if<ConstraintChange>(&later);
  const auto* const moved = std::get_if<TargetChange>(&change);
  if (constraint != nullptr && moved != nullptr) {
    LIMBER_DEMAND(constraint->value.has_value());
    constraint->value->target = moved->target;
    return;
  }
  auto* const keyframe = std::get_if<KeyframeChange>(&later);
  const auto* const shifted = std::get_if<KeyframeShift>(&change);
  if (keyframe != nullptr && shifted != nullptr) {
    LIMBER_DEMAND(keyframe->value.has_value());
    keyframe->value->frame = shifted->frame;
    keyframe->value->weight = shifted->weight;
    return;
  }
  later = change;
}

}  // namespace

TouchedIds touched_by(const Change& change) {
  if (const auto* constraint = std::get_if<ConstraintChange>(&change)) return {constraint->id, 0};
  if (const auto* moved = std::get_if<TargetChange>(&change)) return {moved->id, 0};
  if (const auto* keyframe = std::get_if<KeyframeChange>(&change)) return {0, keyframe->id};
  if (const auto* shifted = std::get_if<KeyframeShift>(&change)) return {0, shifted->id};
  return {};
}

TouchedIds touched_by(const ChangeGroup& group) {
  if (group.empty()) return {};
  const TouchedIds ids = touched_by(group.front());
  const bool single = std::all_of(group.begin(), group.end(),
                                  [&](const Change& change) { return touched_by(change) == ids; });
  return single ? ids : TouchedIds{};
}

ChangeGroup merged(std::span<const Change> changes) {
  if (changes.size() == 1) return {changes.front()};
  ChangeGroup group;  // newest first
  std::map<Thing, std::size_t> places;
  for (auto change = changes.rbegin(); change != changes.rend(); ++change) {
    const auto [place, is_new] = places.emplace(thing_of(*change), group.size());
    if (is_new) {
      group.push_back(*change);
    } else {
      follow_by(group[place->second], *change);
    }
  }
  std::reverse(group.begin(), group.end());
  return group;
}

std::string common_thing(const ChangeGroup& one, const ChangeGroup& other) {
  const auto key_of = [](const Change& change) {
    const bool is_keyframe = std::holds_alternative<KeyframeChange>(change) ||
                             std::holds_alternative<KeyframeShift>(change);
    return is_keyframe ? Thing{kKeyframe, 0} : thing_of(change);
  };
  std::set<Thing> things;
  for (const Change& change : one) things.insert(key_of(change));
  for (const Change& change : other) {
    const Thing thing = key_of(change);
    if (!things.contains(thing)) continue;
    if (thing.first == kConstraint) return fmt::format("constraint {}", thing.second);
    if (thing.first == kKeyframe) return "a keyframe";
    if (std::holds_alternative<EndsChange>(change)) return "the ends";
    if (std::holds_alternative<PinsChange>(change)) return "the pins";
    return std::holds_alternative<DynamicsChange>(change) ? "the dynamics" : "the material";
  }
  return "";
}

void ChangeSteps::push(std::shared_ptr<const ChangeGroup> group, std::uint64_t content,
                       StepNote note) {
  const std::size_t bytes = bytes_of_group(*group);
  const TouchedIds ids = touched_by(*group);
  steps_.push_back({std::move(group), content, ids, bytes, std::move(note)});
  bytes_ += bytes;
}

ChangeSteps::Step ChangeSteps::pop_newest() {
  Step step = std::move(steps_.back());
  steps_.pop_back();
  bytes_ -= step.bytes;
  return step;
}

void ChangeSteps::drop_oldest() {
  bytes_ -= steps_.front().bytes;
  steps_.pop_front();
}

}  // namespace limber::session
