// Checkpoints of documents of bodies.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <type_traits>
#include <utility>
#include <variant>

#include "engine/base/error.h"
#include "engine/session/bodies/document.h"

namespace limber::session {
namespace {

std::vector<ChangeSteps::Step> steps_of(const ChangeSteps& steps) {
  std::vector<ChangeSteps::Step> list;
  list.reserve(steps.size());
  for (std::size_t age = steps.size(); age > 0; --age) list.push_back(steps.at_age(age - 1));
  return list;
}

ChangeSteps stack_of(const std::vector<ChangeSteps::Step>& list) {
  ChangeSteps steps;
  for (const ChangeSteps::Step& step : list) steps.push(step.group, step.content, step.note);
  return steps;
}

[[noreturn]] void refuse(const std::string& what, const char* field = "steps") {
  throw Error(ErrorCode::kInvalidArgument, field, what);
}

void demand_given(std::uint64_t number, std::uint64_t last, const char* what, const char* field) {
  if (number <= last) return;
  refuse(fmt::format("{} {} is there, and {} is the last that was given", what, number, last),
         field);
}

/// The largest ids that are there, or in the steps.
struct LargestIds {
  std::uint64_t constraint = 0, keyframe = 0;

  explicit LargestIds(const Document::Checkpoint& checkpoint) {
    for (const scene::Constraint& one : checkpoint.constraints)
      constraint = std::max(constraint, one.id);
    for (const scene::Keyframe& one : checkpoint.keyframes) keyframe = std::max(keyframe, one.id);
    for (const auto* steps : {&checkpoint.undo, &checkpoint.redo}) {
      for (const ChangeSteps::Step& step : *steps) note(*step.group);
    }
  }
  void note(const ChangeGroup& group) {
    for (const Change& change : group) {
      if (const auto* one = std::get_if<ConstraintChange>(&change))
        constraint = std::max(constraint, one->id);
      if (const auto* other = std::get_if<KeyframeChange>(&change))
        keyframe = std::max(keyframe, other->id);
    }
  }
};

/// If a client chose an id larger than any count, the count may have wrapped to 0: from then on
/// documents skip the ids in use.
void demand_before_next(std::uint64_t id, std::uint64_t next, const char* what, const char* field) {
  constexpr std::uint64_t kCounted = std::uint64_t{1} << 53u;
  if (id < next || next == 0 || id >= kCounted) return;
  refuse(fmt::format("{} {} is there, and {} would be given next", what, id, next), field);
}

void demand_given(const ChangeSteps::Step& step, const Document::Checkpoint& checkpoint) {
  demand_step_given(step.note, checkpoint.last_step);
  demand_given(step.content, checkpoint.last_content, "content", "last_content");
  for (const Change& change : *step.group) {
    if (const auto* fit = std::get_if<MaterialChange>(&change))
      demand_given(fit->epoch, checkpoint.last_epoch, "fit", "last_epoch");
  }
}

/// Names and numbers that are there were given: otherwise they would be given again.
void demand_given(const Document::Checkpoint& checkpoint) {
  const LargestIds largest(checkpoint);
  demand_before_next(largest.constraint, checkpoint.next_constraint, "constraint",
                     "next_constraint");
  demand_before_next(largest.keyframe, checkpoint.next_keyframe, "keyframe", "next_keyframe");
  demand_given(checkpoint.content, checkpoint.last_content, "content", "last_content");
  demand_given(checkpoint.material.epoch, checkpoint.last_epoch, "fit", "last_epoch");
  for (const auto* steps : {&checkpoint.undo, &checkpoint.redo}) {
    for (const ChangeSteps::Step& step : *steps) demand_given(step, checkpoint);
  }
}

}  // namespace

Document::Checkpoint Document::checkpoint() const {
  return {revision_,
          first_end_,
          last_end_,
          dynamics_,
          material_,
          pins_,
          epochs_,
          constraint_list(),
          keyframe_list(),
          next_id_,
          keyframes_.next_id(),
          content_,
          contents_,
          steps_of(undo_),
          steps_of(redo_),
          steps_};
}

void Document::load(const Checkpoint& checkpoint) {
  revision_ = checkpoint.revision;
  first_end_ = checkpoint.first_end;
  last_end_ = checkpoint.last_end;
  dynamics_ = checkpoint.dynamics;
  material_ = checkpoint.material;
  pins_ = checkpoint.pins;
  epochs_ = checkpoint.last_epoch;
  constraints_.clear();
  nodes_ = 0;
  for (const scene::Constraint& constraint : checkpoint.constraints) {
    nodes_ += scene::node_count_of(constraint);
    constraints_.emplace(constraint.id, constraint);
  }
  keyframes_.replace(checkpoint.keyframes);
  next_id_ = checkpoint.next_constraint;
  keyframes_.set_next_id(checkpoint.next_keyframe);
  content_ = checkpoint.content;
  contents_ = checkpoint.last_content;
  undo_ = stack_of(checkpoint.undo);
  redo_ = stack_of(checkpoint.redo);
  steps_ = checkpoint.last_step;
}

void Document::begin_at(const Checkpoint& checkpoint) {
  LIMBER_DEMAND(revision_ == 0);
  load(checkpoint);
}

void Document::demand_reachable(const Checkpoint& checkpoint) const {
  rules_.check_ends(checkpoint.first_end, checkpoint.last_end);
  ConstraintRules::check_dynamics(checkpoint.dynamics);
  demand_pins(checkpoint.pins);
  if (checkpoint.constraints.size() > static_cast<std::size_t>(limits_.max_constraints))
    refuse(fmt::format("{} constraints, at most {}", checkpoint.constraints.size(),
                       limits_.max_constraints));
  if (checkpoint.undo.size() + checkpoint.redo.size() >
      static_cast<std::size_t>(limits_.undo_depth))
    refuse(fmt::format("{} steps of undo and redo, at most {}",
                       checkpoint.undo.size() + checkpoint.redo.size(), limits_.undo_depth));
  std::set<std::uint64_t> ids;
  for (const scene::Constraint& constraint : checkpoint.constraints) {
    rules_.check(constraint);
    if (constraint.id == 0 || !ids.insert(constraint.id).second)
      refuse(fmt::format("constraint {} is there twice", constraint.id));
  }
  ids.clear();
  for (const scene::Keyframe& keyframe : checkpoint.keyframes) {
    demand_keyframe(keyframe);
    if (keyframe.id == 0 || !ids.insert(keyframe.id).second)
      refuse(fmt::format("keyframe {} is there twice", keyframe.id));
  }
  demand_given(checkpoint);
  Document trial(*this);
  trial.load(checkpoint);
  if (trial.nodes_ > limits_.max_nodes)
    refuse(fmt::format("constraints name {} nodes, at most {}", trial.nodes_, limits_.max_nodes));
  // To the end of both stacks, each from the current state.
  trial.try_steps(trial.undo_);
  trial.load(checkpoint);
  trial.try_steps(trial.redo_);
}

/// Makes the changes of all steps, the newest first.
void Document::try_steps(const ChangeSteps& steps) {
  for (std::size_t age = 0; age < steps.size(); ++age) {
    const ChangeGroup& group = *steps.at_age(age).group;
    for (auto change = group.rbegin(); change != group.rend(); ++change) {
      demand_possible(*change);
      (void)exchange(*change);
    }
  }
}

void Document::demand_keyframe(const scene::Keyframe& keyframe) const {
  for (const scene::Issue& fault : keyframes_.rules().faults(keyframe))
    throw Error(fault.code, fault.field, fault.message);
}

/// @throws Error where no edit makes it now
void Document::demand_possible(const Change& change) const {
  std::visit(
      [&](const auto& one) {
        using T = std::decay_t<decltype(one)>;
        if constexpr (std::is_same_v<T, ConstraintChange>) {
          if (!one.value) return demand_known(one.id, "id");
          if (one.id == 0 || one.value->id != one.id)
            refuse(fmt::format("a change of constraint {} has another", one.id));
          rules_.check(*one.value);
        } else if constexpr (std::is_same_v<T, TargetChange>) {
          demand_known(one.id, "id");
          rules_.check_target(one.target);
        } else if constexpr (std::is_same_v<T, EndsChange>) {
          rules_.check_ends(one.first, one.last);
        } else if constexpr (std::is_same_v<T, DynamicsChange>) {
          ConstraintRules::check_dynamics(one.dynamics);
        } else if constexpr (std::is_same_v<T, PinsChange>) {
          demand_pins(one.paths);
        } else if constexpr (std::is_same_v<T, KeyframeChange>) {
          if (!one.value) return (void)keyframes_.removed(one.id);
          if (one.id == 0 || one.value->id != one.id)
            refuse(fmt::format("a change of keyframe {} has another", one.id));
          demand_keyframe(*one.value);
        } else if constexpr (std::is_same_v<T, KeyframeShift>) {
          (void)keyframes_.removed(one.id);  // it is there
          for (const auto& fault : {keyframes_.rules().frame_fault(one.frame),
                                    scene::KeyframeRules::weight_fault(one.weight)}) {
            if (fault) throw Error(fault->code, fault->field, fault->message);
          }
        }
      },
      change);
}

}  // namespace limber::session
