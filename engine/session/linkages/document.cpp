#include "engine/session/linkages/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "engine/session/core/edit_request.h"
#include "engine/session/core/keyed_items.h"
#include "engine/session/core/limit_checks.h"
#include "engine/session/core/limit_error.h"
#include "engine/session/core/taking_back.h"

namespace limber::session {
namespace {

using scene::LinkageConditions;
using scene::LinkageTarget;

/// The last name of a path: "pins[2].joint" is about a joint, "mean_angle" about itself.
std::string last_field(const std::string& path) {
  const auto dot = path.rfind('.');
  return dot == std::string::npos ? path : path.substr(dot + 1);
}

std::size_t bytes_of(const LinkageConditions& conditions) {
  const auto of = [](const auto& items) {
    return items.size() * sizeof(typename std::decay_t<decltype(items)>::value_type);
  };
  return sizeof(LinkageConditions) + of(conditions.pins) + of(conditions.angles) +
         of(conditions.targets) + of(conditions.loads) +
         sizeof(double) * static_cast<std::size_t>(conditions.segment_lengths.size() +
                                                   conditions.edge_lengths.size() +
                                                   conditions.section_scales.size());
}

/// @throws Error{kFailedPrecondition} where what the step changed was changed since
LinkageConditions taken_back(const TakingBack& taking, LinkageConditions now,
                             const LinkageConditions& before, const LinkageConditions& after) {
  const auto of_joint = [](const char* what) {
    return [what](int joint) { return fmt::format("the {} of joint {}", what, joint); };
  };
  taking.list(now.pins, before.pins, after.pins, &scene::JointPin::joint, of_joint("pin"));
  taking.list(now.angles, before.angles, after.angles, &scene::JointAngle::joint,
              of_joint("angle"));
  taking.list(now.loads, before.loads, after.loads, &scene::JointLoad::joint, of_joint("load"));
  taking.list(now.targets, before.targets, after.targets, &LinkageTarget::id,
              [](std::uint64_t id) { return fmt::format("target {}", id); });
  taking.value(now.mean_angle, before.mean_angle, after.mean_angle, "the mean angle");
  taking.value(now.gravity, before.gravity, after.gravity, "gravity");
  const auto are_equal = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
    return a.size() == b.size() && a == b;
  };
  for (auto [sizes, what] : {std::pair{&LinkageConditions::segment_lengths, "the lengths"},
                             std::pair{&LinkageConditions::edge_lengths, "the lengths"},
                             std::pair{&LinkageConditions::section_scales, "the sections"}})
    taking.value(now.*sizes, before.*sizes, after.*sizes, what, are_equal);
  taking.value(now.erection, before.erection, after.erection, "the erection");
  return now;
}

bool loads_nothing(const scene::JointLoad& load) {
  return load.force.isZero(0) && load.moment.isZero(0) && load.torque == 0;
}

}  // namespace

void LinkageLimits::validate() const {
  demand_not_negative(undo_depth, "undo_depth");
  demand_not_negative(max_targets, "max_targets");
  demand_not_negative(steps_at_once, "steps_at_once");
  constexpr int kLeastEdges = 3;
  if (most_chosen_edges < kLeastEdges) {
    throw Error(ErrorCode::kInvalidArgument, "most_chosen_edges",
                fmt::format("{} must be at least {}", most_chosen_edges, kLeastEdges));
  }
}

namespace {

/// Conditions under edits.
struct LinkageConditionEdits {
  explicit LinkageConditionEdits(const LinkageConditions& from)
      : pins(from.pins, &scene::JointPin::joint),
        angles(from.angles, &scene::JointAngle::joint),
        targets(from.targets, &LinkageTarget::id),
        loads(from.loads, &scene::JointLoad::joint),
        mean_angle(from.mean_angle),
        gravity(from.gravity),
        segment_lengths(from.segment_lengths),
        edge_lengths(from.edge_lengths),
        section_scales(from.section_scales),
        erection(from.erection) {}

  [[nodiscard]] LinkageConditions made() const {
    return {pins.list(), angles.list(),   mean_angle,   targets.list(), loads.list(),
            gravity,     segment_lengths, edge_lengths, section_scales, erection};
  }

  KeyedItems<scene::JointPin, int> pins;
  KeyedItems<scene::JointAngle, int> angles;
  KeyedItems<LinkageTarget, std::uint64_t> targets;
  KeyedItems<scene::JointLoad, int> loads;
  // As of LinkageConditions:
  std::optional<double> mean_angle;
  Eigen::Vector3d gravity;
  Eigen::VectorXd segment_lengths, edge_lengths, section_scales;
  std::shared_ptr<const scene::LinkageErection> erection;
};

}  // namespace

/// One request running on a copy of the state.
class LinkageDocument::Request {
 public:
  Request(const LinkageDocument& document, Author author)
      : document_(document), state_(document.state_), author_(std::move(author)) {}

  /// @returns the target the edit touched, 0 if none
  std::uint64_t apply(const LinkageEdit& edit) {
    const std::uint64_t id = std::visit([this](const auto& what) { return take(what); }, edit);
    ++edits_;
    return id;
  }

  [[nodiscard]] std::vector<scene::Issue> take_warnings() { return std::move(warnings_); }

  State finish() {
    close_step();
    return std::move(state_);
  }

 private:
  std::uint64_t take(const PinJoint& pin) {
    demand_joint(pin.joint);
    const bool was_pinned = conditions().pins.erase_all(pin.joint) > 0;
    if (!was_pinned && !pin.held)
      warn("joint", fmt::format("joint {} is not pinned; nothing was released", pin.joint));
    if ((was_pinned || pin.held) && conditions().erection && !conditions().erection->push.empty()) {
      warn("joint",
           "the erection of this design was found with other supports: opened from flat, the shape "
           "may be on another branch");
    }
    if (pin.held) conditions().pins.push_back({pin.joint, *pin.held, pin.position});
    return changed();
  }
  std::uint64_t take(const SetJointAngle& setting) {
    demand_joint(setting.joint);
    if (conditions().angles.erase_all(setting.joint) == 0 && !setting.angle) {
      warn("joint", fmt::format("the angle of joint {} is not set; {}", setting.joint,
                                pins_angle(setting.joint) ? "its pin holds it: release that"
                                                          : "nothing was released"));
    }
    if (setting.angle) conditions().angles.push_back({setting.joint, *setting.angle});
    return changed();
  }
  std::uint64_t take(const SetMeanAngle& setting) {
    if (!conditions().mean_angle && !setting.angle)
      warn("mean_angle", "the mean angle is not set; nothing was released");
    conditions().mean_angle = setting.angle;
    return changed();
  }
  std::uint64_t take(const AddTarget& add) {
    if (conditions().targets.size() >= static_cast<std::size_t>(document_.limits_.max_targets)) {
      const std::size_t count = conditions().targets.size() + 1;
      const int limit = document_.limits_.max_targets;
      throw LimitError("target", fmt::format("{} targets: more than the limit of {}", count, limit),
                       static_cast<std::uint64_t>(limit), count);
    }
    LinkageTarget target = add.target;
    if (target.id == 0) target.id = state_.last_id + 1;
    state_.last_id = std::max(state_.last_id, target.id);
    conditions().targets.push_back(target);
    return changed(target.id);
  }
  std::uint64_t take(const MoveTarget& move) {
    find_target(move.id).position = move.position;
    return changed(move.id);
  }
  std::uint64_t take(const ReplaceTarget& replace) {
    find_target(replace.target.id) = replace.target;
    return changed(replace.target.id);
  }
  std::uint64_t take(const RemoveTarget& remove) {
    (void)find_target(remove.id);
    conditions().targets.erase_first(remove.id);
    return changed(remove.id);
  }
  std::uint64_t take(const SetJointLoad& set) {
    demand_joint(set.load.joint);
    const bool loaded = conditions().loads.erase_all(set.load.joint) > 0;
    if (!loads_nothing(set.load)) {
      conditions().loads.push_back(set.load);
    } else if (!loaded) {
      warn("joint", fmt::format("joint {} carries no load; nothing was removed", set.load.joint));
    }
    return changed();
  }
  std::uint64_t take(const SetGravity& set) {
    conditions().gravity = set.gravity;
    return changed();
  }
  std::uint64_t take(const SetSegmentLengths& set) {
    conditions().erection.reset();
    conditions().segment_lengths = set.lengths;
    conditions().edge_lengths.resize(0);
    return changed();
  }
  std::uint64_t take(const SetEdgeLengths& set) {
    conditions().erection.reset();
    conditions().edge_lengths = set.lengths;
    conditions().segment_lengths.resize(0);
    return changed();
  }
  std::uint64_t take(const SetSectionScales& set) {
    conditions().erection.reset();
    conditions().section_scales = set.scales;
    return changed();
  }
  std::uint64_t take(const SetErection& set) {
    conditions().erection = set.erection;
    return changed();
  }
  std::uint64_t take(const Undo& undo) {
    close_step_inside();
    const bool is_own = undo.whose == Whose::kOwn && !author_.empty();
    const auto age = is_own ? choice().to_undo() : std::nullopt;
    if (age) return take_back(*age);
    state_.history.undo();
    return returned();
  }
  std::uint64_t take(const Redo& redo) {
    close_step_inside();
    const bool is_own = redo.whose == Whose::kOwn && !author_.empty();
    const auto age = is_own ? choice().to_redo(state_.history.redo_note()) : std::nullopt;
    if (age) return take_back(*age);
    state_.history.redo();
    return returned();
  }

  [[nodiscard]] StepChoice choice() const {
    const auto& history = state_.history;
    return {history.undo_count(),
            [&](std::size_t age) -> const StepNote& { return history.note(age); }, author_};
  }
  /// By a step of its own.
  std::uint64_t take_back(std::size_t age) {
    const auto& history = state_.history;
    const auto above = choice().above(age);
    const TakingBack taking(above.empty() ? Author() : history.note(above.front()).author);
    conditions_.emplace(
        taken_back(taking, *history.now(), history.before(age), history.after(age)));
    takes_back_ = history.note(age).number;
    is_open_ = true;
    close_step();
    conditions_.reset();
    return 0;
  }

  std::uint64_t returned() {
    state_.is_return = true;
    conditions_.reset();
    return 0;
  }
  /// Those that hold now; steps back and forth copy none.
  LinkageConditionEdits& conditions() {
    if (!conditions_) conditions_.emplace(*state_.history.now());
    return *conditions_;
  }
  LinkageTarget& find_target(std::uint64_t id) {
    LinkageTarget* const found = conditions().targets.find(id);
    if (found == nullptr)
      throw Error(ErrorCode::kNotFound, "id", fmt::format("there is no target {}", id));
    return *found;
  }

  [[nodiscard]] bool pins_angle(int joint) {
    const scene::JointPin* const pin = conditions().pins.find(joint);
    return pin != nullptr && pin->held != scene::Held::kMotion;
  }

  void warn(const char* field, std::string message) {
    warnings_.push_back({scene::Issue::Severity::kWarning,
                         fmt::format("edits[{}].{}", edits_, field), std::move(message)});
  }

  void demand_joint(int joint) const {
    if (joint >= 0 && joint < document_.joints_) return;
    throw Error(ErrorCode::kOutOfRange, "joint",
                fmt::format("joint {} is outside 0 .. {}", joint, document_.joints_ - 1));
  }

  std::uint64_t changed(std::uint64_t id = 0) {
    is_open_ = true;
    return id;
  }

  /// Ends a step inside a request, before the request's last step.
  void close_step_inside() {
    if (is_open_) demand_steps(++steps_, document_.limits_.steps_at_once);
    close_step();
  }
  /// Refuses what the conditions may not be.
  void close_step() {
    if (!std::exchange(is_open_, false)) return;
    LinkageConditions made = conditions().made();
    const auto issues = document_.issues_of(made);
    if (!issues.empty())
      throw Error(issues[0].code, last_field(issues[0].field), issues[0].message);
    state_.history.step_to(
        std::move(made), document_.limits_.undo_depth, document_.limits_.undo_bytes,
        [shape = document_.limits_.shape_bytes](const LinkageConditions& conditions) {
          return bytes_of(conditions) + shape;
        },
        {author_, 0, std::exchange(takes_back_, 0)});
    state_.is_return = false;
  }

  const LinkageDocument& document_;
  State state_;
  std::optional<LinkageConditionEdits>
      conditions_;  // of state_, with the edits since; none: no edits
  const Author author_;
  bool is_open_ = false;          // edits since the last step
  std::uint64_t takes_back_ = 0;  // the number of the step that the open one takes back
  int steps_ = 0;                 // closed inside the request
  int edits_ = 0;                 // taken
  std::vector<scene::Issue> warnings_;
};

/// Targets without an id get one.
LinkageDocument::State LinkageDocument::first_state(LinkageConditions conditions) {
  std::uint64_t last_id = 0;
  for (const LinkageTarget& target : conditions.targets) last_id = std::max(last_id, target.id);
  for (LinkageTarget& target : conditions.targets)
    if (target.id == 0) target.id = ++last_id;
  return {SnapshotHistory(std::move(conditions)), last_id};
}

LinkageDocument::LinkageDocument(LinkageConditions conditions, int joints, int segments,
                                 LinkageLimits limits, Check check)
    : joints_(joints),
      segments_(segments),
      limits_(limits),
      check_(std::move(check)),
      state_(first_state(std::move(conditions))) {
  limits.validate();
  const LinkageConditions& first = *state_.history.now();
  const auto issues = scene::validate(first, joints, segments);
  if (!issues.empty()) throw Error(issues[0].code, issues[0].field, issues[0].message);
  if (first.targets.size() > static_cast<std::size_t>(limits.max_targets)) {
    throw Error(
        ErrorCode::kLimitExceeded, "targets",
        fmt::format("{} targets, the limit is {}", first.targets.size(), limits.max_targets));
  }
}

std::vector<std::shared_ptr<const LinkageConditions>> LinkageDocument::steps_before_return() const {
  if (!state_.is_return) return {};
  const auto& steps = state_.history.undo_steps();
  return {steps.rbegin(), steps.rend()};
}

std::vector<scene::Issue> LinkageDocument::issues_of(const LinkageConditions& conditions) const {
  auto issues = scene::validate(conditions, joints_, segments_);
  if (issues.empty() && check_) issues = check_(conditions);
  return issues;
}

void LinkageDocument::demand_reachable(const Checkpoint& checkpoint) const {
  demand_history(checkpoint.history, limits_.undo_depth);
  for_each_snapshot(checkpoint.history, [&](const LinkageConditions& conditions) {
    const auto issues = issues_of(conditions);
    if (!issues.empty()) throw Error(issues[0].code, issues[0].field, issues[0].message);
    for (const LinkageTarget& target : conditions.targets) {
      if (target.id > checkpoint.last_id)
        throw Error(ErrorCode::kInvalidArgument, "last_target",
                    fmt::format("target {} is there, and {} is the last that was given", target.id,
                                checkpoint.last_id));
    }
  });
}

void LinkageDocument::begin_at(Checkpoint checkpoint) {
  LIMBER_DEMAND(revision_ == 0);
  state_ = {SnapshotHistory<LinkageConditions>(std::move(checkpoint.history)), checkpoint.last_id,
            checkpoint.is_return};
  revision_ = checkpoint.revision;
}

LinkageDocument::Prepared LinkageDocument::prepare(const std::vector<LinkageEdit>& edits,
                                                   std::optional<Revision> expected,
                                                   const Author& author) const {
  return prepare_edits(edits, expected, revision_, [&] { return Request(*this, author); });
}

EditReceipt LinkageDocument::commit(Prepared&& prepared) {
  return commit_edits(prepared, state_, revision_);
}

}  // namespace limber::session
