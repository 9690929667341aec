#include "engine/session/beams/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/base/rotations/logarithm.h"
#include "engine/session/beams/remarks.h"
#include "engine/session/core/edit_request.h"
#include "engine/session/core/keyed_items.h"
#include "engine/session/core/limit_checks.h"
#include "engine/session/core/taking_back.h"

namespace limber::session {
namespace {

using beams::BeamSupport;
using beams::PrescribedMotion;

/// The last name of a path: "loads[2].node" is about a node, "motions[1]" about the whole edit.
std::string last_name(const std::string& path) {
  const std::string name = path.substr(path.rfind('.') + 1);
  return name.find('[') == std::string::npos ? name : "";
}

bool is_nothing(const beams::NodalLoad& load) {
  return load.force.isZero(0) && load.moment.isZero(0);
}

bool holds_anything(const BeamSupport& support) {
  return std::find(support.fixed.begin(), support.fixed.end(), true) != support.fixed.end();
}

}  // namespace

void BeamLimits::validate() const {
  demand_not_negative(undo_depth, "undo_depth");
  demand_not_negative(steps_at_once, "steps_at_once");
}

namespace {

/// Conditions under edits.
struct BeamConditionEdits {
  explicit BeamConditionEdits(const BeamConditions& from)
      : supports(from.supports, &BeamSupport::node),
        motions(from.motions, &PrescribedMotion::node),
        loads(from.loads, &beams::NodalLoad::node),
        distributed_loads(from.distributed_loads, &beams::DistributedLoad::element),
        gravity(from.gravity),
        temporary_loads(from.temporary_loads) {}

  [[nodiscard]] BeamConditions made() const {
    return {supports.list(),          motions.list(), loads.list(),
            distributed_loads.list(), gravity,        temporary_loads};
  }

  KeyedItems<BeamSupport, int> supports;
  KeyedItems<PrescribedMotion, int> motions;
  KeyedItems<beams::NodalLoad, int> loads;
  KeyedItems<beams::DistributedLoad, int> distributed_loads;
  // As of BeamConditions:
  Eigen::Vector3d gravity;
  std::vector<beams::NodalLoad> temporary_loads;
};

/// @throws Error{kFailedPrecondition} where what the step changed was changed since
BeamConditions taken_back(const TakingBack& taking, BeamConditions now,
                          const BeamConditions& before, const BeamConditions& after) {
  const auto of_node = [](const char* what) {
    return [what](int node) { return fmt::format("the {} of node {}", what, node); };
  };
  taking.list(now.supports, before.supports, after.supports, &BeamSupport::node,
              of_node("support"));
  taking.list(now.motions, before.motions, after.motions, &PrescribedMotion::node,
              of_node("motion"));
  taking.list(now.loads, before.loads, after.loads, &beams::NodalLoad::node, of_node("load"));
  taking.list(now.distributed_loads, before.distributed_loads, after.distributed_loads,
              &beams::DistributedLoad::element,
              [](int element) { return fmt::format("the load of element {}", element); });
  taking.value(now.gravity, before.gravity, after.gravity, "gravity");
  return now;
}

}  // namespace

/// One request running on a copy of the history.
class BeamDocument::Request {
 public:
  Request(const BeamDocument& document, const Places& places, Author author)
      : document_(document),
        places_(places),
        history_(document.history_),
        author_(std::move(author)) {}

  void apply(const BeamEdit& edit) {
    std::visit([this](const auto& what) { take(what); }, edit);
    ++edits_;
  }

  [[nodiscard]] std::vector<scene::Issue> take_warnings() { return std::move(warnings_); }

  History finish() {
    close_step();
    return std::move(history_);
  }

 private:
  void take(const SetSupport& set) {
    demand_node(set.support.node);
    begin_step();
    conditions().supports.erase_all(set.support.node);
    if (holds_anything(set.support)) conditions().supports.push_back(set.support);
  }
  void take(const MoveNode& move) { bring(move.motion); }
  void take(const HoldNode& hold) {
    demand_node(hold.node);
    PrescribedMotion motion = *by_axes(places_.of(hold.node), axes_of(hold.node));
    // The attitude does not tell turns that are known.
    if (const PrescribedMotion* const found = conditions().motions.find(hold.node);
        found != nullptr && found->rotates_all())
      motion.rotation = rotations::nearest_branch(motion.rotation, found->rotation);
    motion.node = hold.node;
    motion.translates = hold.translations;
    motion.rotates = {hold.rotations, hold.rotations, hold.rotations};
    bring(motion);
  }
  void take(const ReleaseNode& release) {
    demand_node(release.node);
    begin_step();
    if (conditions().supports.find(release.node) == nullptr &&
        conditions().motions.find(release.node) == nullptr)
      warn("node", fmt::format("node {} is not held; nothing was released", release.node));
    conditions().supports.erase_all(release.node);
    conditions().motions.erase_all(release.node);
  }
  void take(const SetNodeLoad& set) {
    demand_node(set.load.node);
    begin_step();
    const bool loaded = conditions().loads.find(set.load.node) != nullptr;
    conditions().loads.erase_all(set.load.node);
    if (!is_nothing(set.load)) {
      conditions().loads.push_back(set.load);
    } else if (!loaded) {
      warn("node", fmt::format("node {} carries no load; nothing was removed", set.load.node));
    }
  }
  void take(const SetElementLoad& set) {
    demand(set.load.element, document_.model_.elements.size(), "element");
    begin_step();
    const auto erased = conditions().distributed_loads.erase_all(set.load.element);
    if (!set.load.force.isZero(0)) {
      conditions().distributed_loads.push_back(set.load);
    } else if (erased == 0) {
      warn("element",
           fmt::format("element {} carries no load; nothing was removed", set.load.element));
    }
  }
  void take(const PushNode& push) {
    demand_node(push.load.node);
    begin_step();
    conditions().temporary_loads.push_back(push.load);
  }
  void take(const SetGravity& set) {
    begin_step();
    conditions().gravity = set.gravity;
    if (!set.gravity.isZero(0) && !remark_on_gravity().empty())
      warn("gravity", remark_on_gravity());
  }
  void take(const Undo& undo) {
    close_step_inside();
    const bool is_own = undo.whose == Whose::kOwn && !author_.empty();
    const auto age = is_own ? choice().to_undo() : std::nullopt;
    if (age) return take_back(*age);
    history_.undo();
    conditions_.reset();
  }
  void take(const Redo& redo) {
    close_step_inside();
    const bool is_own = redo.whose == Whose::kOwn && !author_.empty();
    const auto age = is_own ? choice().to_redo(history_.redo_note()) : std::nullopt;
    if (age) return take_back(*age);
    history_.redo();
    conditions_.reset();
  }

  [[nodiscard]] StepChoice choice() const {
    return {history_.undo_count(),
            [&](std::size_t age) -> const StepNote& { return history_.note(age); }, author_};
  }
  /// By a step of its own. Pushes acted once: they are not taken back.
  void take_back(std::size_t age) {
    const auto above = choice().above(age);
    const TakingBack taking(above.empty() ? Author() : history_.note(above.front()).author);
    conditions_.emplace(
        taken_back(taking, *history_.now(), history_.before(age), history_.after(age)));
    takes_back_ = history_.note(age).number;
    begin_step();
    close_step();
    conditions_.reset();
  }

  /// Those that hold now; steps back and forth copy none.
  BeamConditionEdits& conditions() {
    if (!conditions_) conditions_.emplace(*history_.now());
    return *conditions_;
  }
  /// The remark on gravity that acts on nothing; empty: it acts on something.
  const std::string& remark_on_gravity() {
    if (remark_on_gravity_) return *remark_on_gravity_;
    beams::BeamModel model = document_.model_;
    model.gravity = Eigen::Vector3d::UnitZ();
    remark_on_gravity_.emplace();
    for (const scene::Issue& issue : beam_remarks(model)) {
      if (issue.field == "gravity") remark_on_gravity_ = issue.message;
    }
    return *remark_on_gravity_;
  }

  /// Of what holds the node.
  [[nodiscard]] Eigen::Matrix3d axes_of(int node) {
    if (const BeamSupport* const support = conditions().supports.find(node)) return support->axes;
    if (const PrescribedMotion* const motion = conditions().motions.find(node)) return motion->axes;
    return Eigen::Matrix3d::Identity();
  }

  /// Removes from the support all directions that the motion prescribes; the others stay.
  void bring(const PrescribedMotion& given) {
    demand_node(given.node);
    if (!given.translates_any() && !given.rotates_any())
      throw Error(ErrorCode::kInvalidArgument, "node",
                  fmt::format("the motion of node {} gives no direction", given.node));
    begin_step();
    PrescribedMotion motion = by_axes(given, axes_of(given.node)).value_or(given);
    if (BeamSupport* const support = conditions().supports.find(motion.node)) {
      // By other axes than the support's it is refused.
      const bool fits = by_axes(motion, support->axes).has_value();
      for (std::size_t k = 0; fits && k < 3; ++k) {
        support->fixed[k] = support->fixed[k] && !motion.translates[k];
        support->fixed[3 + k] = support->fixed[3 + k] && !motion.rotates[k];
      }
      if (!holds_anything(*support)) conditions().supports.erase_all(motion.node);
    }
    PrescribedMotion* const found = conditions().motions.find(motion.node);
    found == nullptr ? conditions().motions.push_back(motion) : add(motion, *found);
  }

  /// Directions of the new motion replace those of the held one; the other directions stay.
  static void add(const PrescribedMotion& motion, PrescribedMotion& held) {
    const auto by_these = by_axes(held, motion.axes);
    if (!by_these) {
      if ((motion.translates_all() || !held.translates_any()) &&
          (motion.rotates_all() || !held.rotates_any())) {
        held = motion;
        return;
      }
      throw Error(ErrorCode::kInvalidArgument, "",
                  fmt::format("node {} is held by other axes: give directions by these, all three, "
                              "or release it first",
                              motion.node));
    }
    held = *by_these;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      if (motion.translates[k]) {
        held.translates[k] = true;
        held.translation[i] = motion.translation[i];
      }
      if (motion.rotates[k]) {
        held.rotates[k] = true;
        held.rotation[i] = motion.rotation[i];
      }
    }
  }

  void warn(const std::string& field, const std::string& message) {
    warnings_.push_back(
        {scene::Issue::Severity::kWarning, fmt::format("edits[{}].{}", edits_, field), message});
  }

  static void demand(int index, std::size_t count, const char* what) {
    if (index >= 0 && static_cast<std::size_t>(index) < count) return;
    throw Error(ErrorCode::kOutOfRange, what,
                fmt::format("{} {} is outside 0 .. {}", what, index, count - 1));
  }
  void demand_node(int node) const { demand(node, document_.model_.nodes.size(), "node"); }

  /// Temporary loads of the step before are over.
  void begin_step() {
    if (!std::exchange(is_open_, true)) conditions().temporary_loads.clear();
  }

  /// Ends a step inside a request, before the request's last step.
  void close_step_inside() {
    if (is_open_) demand_steps(++steps_, document_.limits_.steps_at_once);
    close_step();
  }
  /// Refuses what the conditions may not be.
  void close_step() {
    if (!std::exchange(is_open_, false)) return;
    BeamConditions made = conditions().made();
    try {
      validate_conditions(with_conditions(document_.model_, made));
    } catch (const Error& error) {
      throw Error(error.code(), last_name(error.field()), error.what());
    }
    history_.step_to(std::move(made), document_.limits_.undo_depth, document_.limits_.undo_bytes,
                     [](const BeamConditions& conditions) { return bytes_of(conditions); },
                     {author_, 0, std::exchange(takes_back_, 0)});
  }

  const BeamDocument& document_;
  const Places& places_;
  History history_;
  std::optional<BeamConditionEdits>
      conditions_;  // of history_, with the edits since; none: no edits
  const Author author_;
  bool is_open_ = false;          // edits since the last step
  std::uint64_t takes_back_ = 0;  // the number of the step that the open one takes back
  int steps_ = 0;                 // closed inside the request
  std::optional<std::string> remark_on_gravity_;
  int edits_ = 0;  // taken
  std::vector<scene::Issue> warnings_;
};

BeamDocument::BeamDocument(beams::BeamModel model, BeamLimits limits)
    : model_(std::move(model)), limits_(limits), history_(conditions_of(model_)) {
  limits.validate();
  validate(model_);
}

void BeamDocument::demand_reachable(const Checkpoint& checkpoint) const {
  demand_history(checkpoint.history, limits_.undo_depth);
  beams::BeamModel model = model_;
  for_each_snapshot(checkpoint.history, [&](const BeamConditions& conditions) {
    model = with_conditions(std::move(model), conditions);
    validate_conditions(model);
  });
}

void BeamDocument::begin_at(Checkpoint checkpoint) {
  LIMBER_DEMAND(revision_ == 0);
  history_ = History(std::move(checkpoint.history));
  revision_ = checkpoint.revision;
}

BeamDocument::Prepared BeamDocument::prepare(const std::vector<BeamEdit>& edits,
                                             std::optional<Revision> expected, const Places& places,
                                             const Author& author) const {
  return prepare_edits(edits, expected, revision_, [&] { return Request(*this, places, author); });
}

EditReceipt BeamDocument::commit(Prepared&& prepared) {
  return commit_edits(prepared, history_, revision_);
}

}  // namespace limber::session
