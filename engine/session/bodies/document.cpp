#include "engine/session/bodies/document.h"

#include <fmt/format.h>

#include <span>
#include <type_traits>
#include <utility>

#include "engine/base/error.h"
#include "engine/scene/constraint_path.h"
#include "engine/scene/pinned_motion.h"
#include "engine/session/core/edit_request.h"
#include "engine/session/core/limit_error.h"

namespace limber::session {
namespace {

const char* name_of(const BodyEdit& edit) {
  static constexpr const char* kNames[] = {
      "add.",          "move.",          "replace.",         "remove.",
      "set_ends.",     "set_dynamics.",  "set_material.",    "reset_material.",
      "add_keyframe.", "move_keyframe.", "remove_keyframe.", "set_pins.",
      "undo.",         "redo."};
  static_assert(std::variant_size_v<BodyEdit> == std::size(kNames));
  return kNames[edit.index()];
}

std::string joined(std::string path, const std::string& field) {
  path += field;
  if (!path.empty() && path.back() == '.') path.pop_back();
  return path;
}

/// The first three basis columns of a free body are its translations.
void check_model(const scene::Scene& scene) {
  const int columns = scene.model.basis_size;
  if (!scene.fixed_nodes.empty() || columns <= 0 || columns > 3) return;
  throw Error(ErrorCode::kInvalidArgument, "model.basis_size",
              fmt::format("is {}, a free body takes more than 3, or 0 to choose", columns));
}

template <class Check>
void under(const char* prefix, const Check& check) {
  try {
    check();
  } catch (const Error& error) {
    throw Error(error.code(), joined(prefix, error.field()), error.what());
  }
}

}  // namespace

void Touched::note(const Change& change) {
  if (const auto* constraint = std::get_if<ConstraintChange>(&change)) {
    constraints[constraint->id] = How::kAnything;
  } else if (const auto* moved = std::get_if<TargetChange>(&change)) {
    constraints.try_emplace(moved->id, How::kTargetOnly);
  } else if (std::holds_alternative<EndsChange>(change)) {
    ends = true;
  } else if (std::holds_alternative<DynamicsChange>(change)) {
    dynamics = true;
  } else if (std::holds_alternative<MaterialChange>(change)) {
    material = true;
  } else if (std::holds_alternative<PinsChange>(change)) {
    pins = true;
  } else {
    keyframes = true;
  }
}

void Touched::add(const Touched& more) {
  for (const auto& [id, how] : more.constraints) {
    How& here = constraints.try_emplace(id, how).first->second;
    if (how == How::kAnything) here = how;
  }
  ends = ends || more.ends;
  dynamics = dynamics || more.dynamics;
  material = material || more.material;
  keyframes = keyframes || more.keyframes;
  pins = pins || more.pins;
}

void DocumentLimits::validate() const {
  const auto demand = [](int value, const char* field) {
    if (value < 0)
      throw Error(ErrorCode::kInvalidArgument, field, fmt::format("must be >= 0, is {}", value));
  };
  demand(undo_depth, "undo_depth");
  demand(max_constraints, "max_constraints");
}

std::vector<scene::Issue> document_issues(const scene::Scene& scene) {
  std::vector<scene::Issue> issues;
  const auto note = [&](const std::string& prefix, const auto& check) {
    try {
      check();
    } catch (const Error& error) {
      issues.push_back({scene::Issue::Severity::kError, joined(prefix, error.field()), error.what(),
                        error.code()});
    }
  };
  const ConstraintRules rules(scene);
  note("", [&] { rules.check_ends(scene.first_end, scene.last_end); });
  note("dynamics.", [&] { ConstraintRules::check_frames_per_second(scene.dynamics); });
  note("dynamics.", [&] { ConstraintRules::check_period(scene.dynamics); });
  note("dynamics.", [&] { ConstraintRules::check_damping(scene.dynamics); });
  note("dynamics.", [&] { ConstraintRules::check_smoothing(scene.dynamics); });
  note("dynamics.", [&] { ConstraintRules::check_inertia(scene.dynamics); });
  note("", [&] { check_model(scene); });
  const bool body = scene.mesh.node_count() > 0;
  for (std::size_t i = 0; i < scene.constraints.size(); ++i) {
    const scene::Constraint& constraint = scene.constraints[i];
    const std::string prefix = fmt::format("constraints[{}].", i);
    note(prefix, [&] { rules.check_frame(constraint.frame); });
    note(prefix, [&] { ConstraintRules::check_axes(constraint.axes); });
    note(prefix, [&] { ConstraintRules::check_weight(constraint.weight); });
    if (!body) continue;  // no node is in range, no target in reach
    if (rules.can_check_place(constraint)) note(prefix, [&] { rules.check_place(constraint); });
    note(prefix, [&] { rules.check_target(constraint.target); });
  }
  return issues;
}

/// One call of apply(), with the changes that take it back.
struct Document::Request {
  Touched& touched;  // may name more than what changes in the end: harmless
  const Author& author;
  ChangeGroup back;              // inverses, oldest first, of everything done
  std::size_t step_begin = 0;    // back[step_begin ...] belongs to the running step
  std::uint64_t takes_back = 0;  // the number of the step that the running one takes back
  /// Steps of undo (< 0) and redo (> 0) that are requested and not made yet, see settle().
  std::ptrdiff_t shift = 0;
  std::optional<ChangeSteps> undo, redo;  // the stacks as they were, once they have been changed

  void keep_stacks(const Document& document) {
    if (undo) return;
    redo = document.redo_;
    undo = document.undo_;
  }
};

/// A scene in parts: what edits change, and the rest.
struct Document::Opened {
  explicit Opened(scene::Scene scene)
      : keyframes(scene), constraints(std::move(scene.constraints)) {
    scene.constraints.clear();
    scene.keyframes.clear();
    unedited = std::make_shared<const scene::Scene>(std::move(scene));
  }

  KeyframeSet keyframes;
  std::vector<scene::Constraint> constraints;
  std::shared_ptr<const scene::Scene> unedited;
};

Document::Document(scene::Scene scene, DocumentLimits limits)
    : Document(Opened(std::move(scene)), limits) {}

Document::Document(Opened opened, DocumentLimits limits)
    : limits_(limits),
      unedited_(std::move(opened.unedited)),
      points_(std::make_shared<const scene::SurfacePoints>(*unedited_)),
      rules_(*unedited_, points_),
      first_end_(unedited_->first_end),
      last_end_(unedited_->last_end),
      dynamics_(unedited_->dynamics),
      material_{unedited_->material_optimisation.variables, 0},
      keyframes_(std::move(opened.keyframes)) {
  std::vector<scene::Constraint>& constraints = opened.constraints;
  limits_.validate();
  rules_.check_ends(first_end_, last_end_);
  under("dynamics.", [&] { ConstraintRules::check_dynamics(dynamics_); });
  check_model(*unedited_);
  if (constraints.size() > static_cast<std::size_t>(limits_.max_constraints)) {
    throw Error(ErrorCode::kLimitExceeded, "constraints",
                fmt::format("{} constraints, the limit is {}", constraints.size(),
                            limits_.max_constraints));
  }
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    const scene::Constraint& constraint = constraints[i];
    under(fmt::format("constraints[{}].", i).c_str(), [&] {
      rules_.check(constraint);
      demand_room(scene::node_count_of(constraint));
    });
    nodes_ += scene::node_count_of(constraint);
    if (constraint.id != 0 && !constraints_.emplace(constraint.id, constraint).second) {
      throw Error(ErrorCode::kAlreadyExists, fmt::format("constraints[{}].id", i),
                  fmt::format("id {} is taken by an earlier constraint", constraint.id));
    }
  }
  for (const auto& [id, constraint] : constraints_) next_id_ = id + 1;
  for (scene::Constraint& constraint : constraints) {
    if (constraint.id != 0) continue;
    number(constraint);
    constraints_.emplace(constraint.id, constraint);
  }
}

std::vector<scene::Constraint> Document::constraint_list() const {
  std::vector<scene::Constraint> list;
  list.reserve(constraints_.size());
  for (const auto& [id, constraint] : constraints_) list.push_back(constraint);
  return list;
}

EditReceipt Document::apply(const std::vector<BodyEdit>& edits, std::optional<Revision> expected,
                            Touched& touched, const Author& author) {
  demand_request(edits.size(), expected, revision_);

  const std::uint64_t next_id = next_id_, content = content_;
  const std::uint64_t next_keyframe_id = keyframes_.next_id();
  EditReceipt receipt;
  receipt.constraint_ids.reserve(edits.size());
  receipt.keyframe_ids.reserve(edits.size());
  Request request{touched, author, {}, 0, 0, 0, {}, {}};
  std::size_t i = 0;
  const auto take_back = [&] {
    for (auto change = request.back.rbegin(); change != request.back.rend(); ++change)
      exchange(std::move(*change));
    if (request.undo) undo_ = std::move(*request.undo);
    if (request.redo) redo_ = std::move(*request.redo);
    next_id_ = next_id;
    keyframes_.set_next_id(next_keyframe_id);
    content_ = content;
  };
  try {
    for (; i < edits.size(); ++i) {
      const TouchedIds ids = apply_edit(edits[i], request);
      receipt.constraint_ids.push_back(ids.constraint);
      receipt.keyframe_ids.push_back(ids.keyframe);
    }
    settle(request);
    close_step(request);
    receipt.issues = warnings(edits, receipt);
  } catch (const Error& error) {
    take_back();
    rethrow_at(error, joined(fmt::format("edits[{}].{}", i, name_of(edits[i])), error.field()));
  } catch (...) {
    take_back();
    throw;
  }
  receipt.revision = ++revision_;
  return receipt;
}

void Document::prepare(const std::vector<BodyEdit>& edits) const {
  for (const BodyEdit& edit : edits) {
    if (const auto* added = std::get_if<AddConstraint>(&edit)) points_->prepare(added->constraint);
    if (const auto* replaced = std::get_if<ReplaceConstraint>(&edit))
      points_->prepare(replaced->constraint);
  }
}

bool Document::is_long(const std::vector<BodyEdit>& edits) const {
  constexpr std::size_t kShort = 256;  // changes
  std::size_t changes = edits.size();
  std::size_t undone = 0, redone = 0;  // at most
  for (const BodyEdit& edit : edits) {
    if (std::holds_alternative<Undo>(edit) && undone < undo_.size())
      changes += undo_.at_age(undone++).group->size();
    if (std::holds_alternative<Redo>(edit) && redone < redo_.size())
      changes += redo_.at_age(redone++).group->size();
    if (changes > kShort) return true;
  }
  return false;
}

void Document::exchange_edited(Document& copy) {
  // All but unedited_ and what follows from it, which is read without a lock.
  std::swap(first_end_, copy.first_end_);
  std::swap(last_end_, copy.last_end_);
  std::swap(dynamics_, copy.dynamics_);
  std::swap(material_, copy.material_);
  std::swap(pins_, copy.pins_);
  std::swap(epochs_, copy.epochs_);
  std::swap(constraints_, copy.constraints_);
  keyframes_.exchange_edited(copy.keyframes_);
  std::swap(next_id_, copy.next_id_);
  std::swap(revision_, copy.revision_);
  std::swap(content_, copy.content_);
  std::swap(contents_, copy.contents_);
  std::swap(nodes_, copy.nodes_);
  std::swap(steps_, copy.steps_);
  std::swap(undo_, copy.undo_);
  std::swap(redo_, copy.redo_);
}

/// About values that the edits set, unless later edits of the request replaced them.
std::vector<scene::Issue> Document::warnings(const std::vector<BodyEdit>& edits,
                                             const EditReceipt& receipt) const {
  constexpr std::size_t kMaxWarnings = 20;
  std::vector<scene::Issue> found;
  const auto add = [&](std::size_t i, const char* part, const std::vector<scene::Issue>& issues) {
    for (scene::Issue issue : issues) {
      issue.field = fmt::format("edits[{}].{}{}{}", i, name_of(edits[i]), part, issue.field);
      found.push_back(std::move(issue));
    }
  };
  std::optional<std::vector<scene::Issue>> of_ends;
  std::map<std::uint64_t, std::vector<scene::Issue>> of_constraints;  // that are there
  for (std::size_t i = 0; i < edits.size() && found.size() < kMaxWarnings; ++i) {
    if (std::holds_alternative<SetEnds>(edits[i])) {
      if (!of_ends) of_ends = warnings_of_ends();
      add(i, "", *of_ends);
    } else if (std::holds_alternative<AddConstraint>(edits[i]) ||
               std::holds_alternative<ReplaceConstraint>(edits[i])) {
      const auto held = constraints_.find(receipt.constraint_ids[i]);
      if (held == constraints_.end()) continue;
      const auto [known, is_new] = of_constraints.try_emplace(held->first);
      if (is_new) known->second = rules_.warnings(held->second, first_end_, last_end_);
      add(i, "constraint.", known->second);
    } else if (const bool added = std::holds_alternative<AddKeyframe>(edits[i]);
               added || std::holds_alternative<MoveKeyframe>(edits[i])) {
      const auto held = keyframes_.all().find(receipt.keyframe_ids[i]);
      if (held == keyframes_.all().end()) continue;
      const auto idle = keyframes_.rules().idle_frame(held->second.frame, first_end_, last_end_);
      if (idle) add(i, added ? "keyframe." : "", {*idle});
    }
  }
  return found;
}

/// New ends may hold frames in which there are constraints: reported once for each end.
std::vector<scene::Issue> Document::warnings_of_ends() const {
  int first = 0, last = 0;
  const auto look_at = [&](const auto& where) {  // a frame or a constraint
    const auto idle = [&](scene::End at_first, scene::End at_last) {
      return scene::idle_frame_warning(where, unedited_->frame_count, at_first, at_last) ? 1 : 0;
    };
    first += idle(first_end_, scene::End::kFree);
    last += idle(scene::End::kFree, last_end_);
  };
  for (const auto& [id, constraint] : constraints_) look_at(constraint);
  for (const auto& [id, keyframe] : keyframes_.all()) look_at(keyframe.frame);
  const char* const what = keyframes_.all().empty() ? "constraints" : "constraints and keyframes";
  std::vector<scene::Issue> found;
  const auto add = [&](const char* field, int count) {
    if (count == 0) return;
    found.push_back(
        {scene::Issue::Severity::kWarning, field,
         fmt::format("{} in the frames it holds: {}; they have no effect", what, count)});
  };
  add("first_end", first);
  add("last_end", last);
  return found;
}

TouchedIds Document::apply_edit(const BodyEdit& edit, Request& request) {
  if (!std::holds_alternative<Undo>(edit) && !std::holds_alternative<Redo>(edit)) settle(request);
  return std::visit(
      [&](const auto& e) -> TouchedIds {
        using T = std::decay_t<decltype(e)>;
        if constexpr (std::is_same_v<T, AddConstraint>) {
          return {add(e.constraint, request), 0};
        } else if constexpr (std::is_same_v<T, MoveConstraint>) {
          demand_known(e.id, "id");
          rules_.check_target(e.target);
          if (const auto& held = constraints_.at(e.id); !held.path.empty()) {
            scene::Constraint moved = held;
            scene::move_path(moved, e.target);
            rules_.check(moved);
            make(ConstraintChange{e.id, std::move(moved)}, request);
          } else {
            make(TargetChange{e.id, e.target}, request);
          }
          return {e.id, 0};
        } else if constexpr (std::is_same_v<T, ReplaceConstraint>) {
          demand_known(e.constraint.id, "constraint.id");
          under("constraint.", [&] {
            rules_.check(e.constraint);
            const std::size_t held = scene::node_count_of(constraints_.at(e.constraint.id));
            const std::size_t asked = scene::node_count_of(e.constraint);
            if (asked > held) demand_room(asked - held);
          });
          make(ConstraintChange{e.constraint.id, e.constraint}, request);
          return {e.constraint.id, 0};
        } else if constexpr (std::is_same_v<T, RemoveConstraint>) {
          demand_known(e.id, "id");
          make(ConstraintChange{e.id, std::nullopt}, request);
          return {e.id, 0};
        } else if constexpr (std::is_same_v<T, SetEnds>) {
          rules_.check_ends(e.first, e.last);
          make(EndsChange{e.first, e.last}, request);
          return {};
        } else if constexpr (std::is_same_v<T, SetDynamics>) {
          const scene::Dynamics dynamics = e.dynamics.resolved(dynamics_.discretisation);
          ConstraintRules::check_dynamics(dynamics);
          make(DynamicsChange{dynamics}, request);
          return {};
        } else if constexpr (std::is_same_v<T, SetMaterialVariables>) {
          make(MaterialChange{e.variables, material_.epoch}, request);
          return {};
        } else if constexpr (std::is_same_v<T, ResetMaterial>) {
          make(MaterialChange{material_.variables, ++epochs_}, request);
          return {};
        } else if constexpr (std::is_same_v<T, AddKeyframe>) {
          return {0, add(e.keyframe, request)};
        } else if constexpr (std::is_same_v<T, MoveKeyframe>) {
          make(keyframes_.moved(e), request);
          return {0, e.id};
        } else if constexpr (std::is_same_v<T, RemoveKeyframe>) {
          make(keyframes_.removed(e.id), request);
          return {0, e.id};
        } else if constexpr (std::is_same_v<T, SetPins>) {
          demand_pins(e.paths);
          make(PinsChange{e.paths}, request);
          return {};
        } else if constexpr (std::is_same_v<T, Undo>) {
          return turn(Turn::kUndo, e.whose, request);
        } else {
          return turn(Turn::kRedo, e.whose, request);
        }
      },
      edit);
}

std::uint64_t Document::add(const scene::Constraint& added_value, Request& request) {
  under("constraint.", [&] { rules_.check(added_value); });
  demand_one_more();
  under("constraint.", [&] { demand_room(scene::node_count_of(added_value)); });
  scene::Constraint constraint = added_value;
  if (constraint.id == 0) {
    number(constraint);
  } else if (constraints_.contains(constraint.id)) {
    throw Error(ErrorCode::kAlreadyExists, "constraint.id",
                fmt::format("id {} is taken; 0 lets the session choose one", constraint.id));
  } else if (constraint.id >= next_id_) {
    next_id_ = constraint.id + 1;
  }
  const std::uint64_t id = constraint.id;
  make(ConstraintChange{id, std::move(constraint)}, request);
  return id;
}

std::uint64_t Document::add(const scene::Keyframe& added_value, Request& request) {
  KeyframeChange change = keyframes_.added(added_value);
  const std::uint64_t id = change.id;
  make(std::move(change), request);
  return id;
}

/// Notes one step more. If steps cancel each other, only the remaining ones are made: a request
/// that takes a step of a thousand changes back and forth a thousand times makes none.
TouchedIds Document::turn(Turn turn, Whose whose, Request& request) {
  request.keep_stacks(*this);
  close_step(request);
  const bool undoes = turn == Turn::kUndo;
  if (whose == Whose::kOwn && !request.author.empty()) {
    const auto undone = static_cast<std::size_t>(std::max<std::ptrdiff_t>(-request.shift, 0));
    const auto redone = static_cast<std::size_t>(std::max<std::ptrdiff_t>(request.shift, 0));
    const StepNote* const newest = undone > 0              ? &undo_.at_age(undone - 1).note
                                   : redone < redo_.size() ? &redo_.at_age(redone).note
                                                           : nullptr;
    const auto age = undoes ? choice(request).to_undo() : choice(request).to_redo(newest);
    if (age) return take_back(*age, request);
  }
  const ChangeSteps& ahead = undoes ? undo_ : redo_;
  const ChangeSteps& behind = undoes ? redo_ : undo_;
  const std::ptrdiff_t direction = undoes ? -1 : 1;
  const std::ptrdiff_t gone = direction * request.shift;  // steps of `ahead` that are noted
  TouchedIds ids;
  if (gone < 0) {  // of `behind`, the newest of which are noted
    ids = behind.at_age(static_cast<std::size_t>(-gone - 1)).ids;
  } else if (static_cast<std::size_t>(gone) < ahead.size()) {
    ids = ahead.at_age(static_cast<std::size_t>(gone)).ids;
  } else {
    throw Error(ErrorCode::kFailedPrecondition, "",
                fmt::format("there is nothing to {}", undoes ? "undo" : "redo"));
  }
  request.shift += direction;
  return ids;
}

/// Chooses among the steps that can be undone after the noted ones are made.
StepChoice Document::choice(const Request& request) const {
  const auto undone = static_cast<std::size_t>(std::max<std::ptrdiff_t>(-request.shift, 0));
  const auto redone = static_cast<std::size_t>(std::max<std::ptrdiff_t>(request.shift, 0));
  const auto note = [&](std::size_t age) -> const StepNote& {
    return age < redone ? redo_.at_age(redone - 1 - age).note
                        : undo_.at_age(age - redone + undone).note;
  };
  return {undo_.size() + redone - undone, note, request.author};
}

/// By a step of its own, where nothing that it changed was changed since.
TouchedIds Document::take_back(std::size_t age, Request& request) {
  settle(request);
  const ChangeSteps::Step taken = undo_.at_age(age);
  for (const std::size_t above : choice(request).above(age)) {
    const ChangeSteps::Step& since = undo_.at_age(above);
    const std::string what = common_thing(*taken.group, *since.group);
    if (!what.empty()) refuse_to_take_back(what, since.note.author);
  }
  for (auto change = taken.group->rbegin(); change != taken.group->rend(); ++change) {
    const auto* const constraint = std::get_if<ConstraintChange>(&*change);
    if (constraint != nullptr && constraint->value && !constraints_.contains(constraint->id)) {
      demand_one_more();
      demand_room(scene::node_count_of(*constraint->value));
    }
    make(*change, request);
  }
  request.takes_back = taken.note.number;
  close_step(request);
  return taken.ids;
}

/// Makes the steps that are noted. Any edit after them drops what could be redone: what steps cost
/// was paid for when their edits were made.
void Document::settle(Request& request) {
  for (; request.shift < 0; ++request.shift) step(undo_, redo_, request);
  for (; request.shift > 0; --request.shift) step(redo_, undo_, request);
}

/// Takes the newest group of `from`, applies it backwards in time and leaves its inverse on `to`.
void Document::step(ChangeSteps& from, ChangeSteps& to, Request& request) {
  const ChangeSteps::Step taken = from.pop_newest();
  for (auto change = taken.group->rbegin(); change != taken.group->rend(); ++change)
    make(*change, request);
  to.push(group_of(request), content_, taken.note);
  content_ = taken.content;
  request.step_begin = request.back.size();
}

/// The changes that take back the running step.
std::shared_ptr<const ChangeGroup> Document::group_of(const Request& request) const {
  ChangeGroup group = merged(std::span(request.back).subspan(request.step_begin));
  std::erase_if(group, [&](const Change& change) {
    const auto* const constraint = std::get_if<ConstraintChange>(&change);
    const auto* const keyframe = std::get_if<KeyframeChange>(&change);
    return (constraint != nullptr && !constraint->value &&
            !constraints_.contains(constraint->id)) ||
           (keyframe != nullptr && !keyframe->value && !keyframes_.all().contains(keyframe->id));
  });
  return std::make_shared<const ChangeGroup>(std::move(group));
}

void Document::make(Change change, Request& request) {
  request.touched.note(change);
  // A change that does nothing holds the place, so that nothing can fail between the change and its
  // inverse.
  request.back.emplace_back(EndsChange{first_end_, last_end_});
  request.back.back() = exchange(std::move(change));
}

void Document::close_step(Request& request) {
  if (request.step_begin == request.back.size()) return;
  undo_.push(group_of(request), content_,
             {request.author, ++steps_, std::exchange(request.takes_back, 0)});
  content_ = ++contents_;
  while (undo_.size() > static_cast<std::size_t>(limits_.undo_depth) ||
         (undo_.bytes() > limits_.undo_bytes && undo_.size() > 1))
    undo_.drop_oldest();
  redo_.clear();
  request.step_begin = request.back.size();
}

Change Document::exchange(Change change) {
  if (auto* constraint = std::get_if<ConstraintChange>(&change)) {
    const auto held = constraints_.find(constraint->id);
    if (held == constraints_.end()) {
      LIMBER_DEMAND(constraint->value.has_value());
      nodes_ += scene::node_count_of(*constraint->value);
      constraints_.emplace(constraint->id, std::move(*constraint->value));
      constraint->value.reset();  // the inverse: absent again
    } else if (constraint->value) {
      nodes_ += scene::node_count_of(*constraint->value) - scene::node_count_of(held->second);
      std::swap(*constraint->value, held->second);
    } else {
      nodes_ -= scene::node_count_of(held->second);
      constraint->value = std::move(held->second);
      constraints_.erase(held);
    }
  } else if (auto* moved = std::get_if<TargetChange>(&change)) {
    const auto held = constraints_.find(moved->id);
    LIMBER_DEMAND(held != constraints_.end());
    std::swap(moved->target, held->second.target);
  } else if (auto* ends = std::get_if<EndsChange>(&change)) {
    std::swap(ends->first, first_end_);
    std::swap(ends->last, last_end_);
  } else if (auto* dynamics = std::get_if<DynamicsChange>(&change)) {
    std::swap(dynamics->dynamics, dynamics_);
  } else if (auto* material = std::get_if<MaterialChange>(&change)) {
    std::swap(*material, material_);
  } else if (auto* pins = std::get_if<PinsChange>(&change)) {
    std::swap(pins->paths, pins_);
  } else if (auto* keyframe = std::get_if<KeyframeChange>(&change)) {
    keyframes_.exchange(*keyframe);
  } else if (auto* shifted = std::get_if<KeyframeShift>(&change)) {
    keyframes_.exchange(*shifted);
  }
  return change;
}

void Document::number(scene::Constraint& constraint) {
  while (next_id_ == 0 || constraints_.contains(next_id_)) ++next_id_;
  constraint.id = next_id_++;
}

void Document::demand_one_more() const {
  if (constraints_.size() < static_cast<std::size_t>(limits_.max_constraints)) return;
  throw LimitError("constraint",
                   fmt::format("the scene has {} constraints, the limit is {}", constraints_.size(),
                               limits_.max_constraints),
                   static_cast<std::uint64_t>(limits_.max_constraints), constraints_.size() + 1);
}

void Document::demand_room(std::size_t nodes) const {
  if (nodes_ + nodes > limits_.max_nodes) {
    throw Error(ErrorCode::kLimitExceeded, "nodes",
                fmt::format("the constraints would name {} nodes together, the limit is {}",
                            nodes_ + nodes, limits_.max_nodes));
  }
}

void Document::demand_pins(const PinPaths& paths) const {
  if (!paths) return;
  if (const auto fault = scene::pins_fault(*unedited_, *paths))
    throw Error(fault->code, "pins", fault->message);
}

void Document::demand_known(std::uint64_t id, const char* field) const {
  if (!constraints_.contains(id)) {
    throw Error(ErrorCode::kNotFound, field, fmt::format("there is no constraint {}", id));
  }
}

}  // namespace limber::session
