#include "engine/session/beams/beam_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/base/rotations/logarithm.h"
#include "engine/session/beams/beam_remarks.h"
#include "engine/session/refused_edit.h"

namespace limber::session {
namespace {

using beams::BeamSupport;
using beams::PrescribedMotion;

/// The last name of a path: "loads[2].node" is about a node, "motions[1]" about the whole edit.
std::string last_name(const std::string& path) {
  const std::string name = path.substr(path.rfind('.') + 1);
  return name.find('[') == std::string::npos ? name : "";
}

template <class Item>
void erase_of_node(std::vector<Item>& items, int node) {
  std::erase_if(items, [&](const Item& item) { return item.node == node; });
}

template <class Item>
Item* find_of_node(std::vector<Item>& items, int node) {
  const auto found =
      std::find_if(items.begin(), items.end(), [&](const Item& item) { return item.node == node; });
  return found == items.end() ? nullptr : &*found;
}

bool is_nothing(const beams::NodalLoad& load) {
  return load.force.isZero(0) && load.moment.isZero(0);
}

bool holds_anything(const BeamSupport& support) {
  return std::find(support.fixed.begin(), support.fixed.end(), true) != support.fixed.end();
}

}  // namespace

void BeamLimits::validate() const {
  if (undo_depth < 0)
    throw Error(ErrorCode::kInvalidArgument, "undo_depth",
                fmt::format("undo_depth = {}, must be >= 0", undo_depth));
}

/// One request under way on a copy of the history.
class BeamDocument::Request {
 public:
  Request(const BeamDocument& document, const Places& places)
      : document_(document),
        places_(places),
        history_(document.history_),
        conditions_(*history_.now()) {}

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
    erase_of_node(conditions_.supports, set.support.node);
    if (holds_anything(set.support)) conditions_.supports.push_back(set.support);
  }
  void take(const MoveNode& move) { bring(move.motion); }
  void take(const HoldNode& hold) {
    demand_node(hold.node);
    PrescribedMotion motion = *by_axes(places_.of(hold.node), axes_of(hold.node));
    // The attitude does not tell turns that are known.
    if (const PrescribedMotion* const found = find_of_node(conditions_.motions, hold.node);
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
    if (find_of_node(conditions_.supports, release.node) == nullptr &&
        find_of_node(conditions_.motions, release.node) == nullptr)
      warn("node", fmt::format("nothing holds node {}: there is nothing to release", release.node));
    erase_of_node(conditions_.supports, release.node);
    erase_of_node(conditions_.motions, release.node);
  }
  void take(const SetNodeLoad& set) {
    demand_node(set.load.node);
    begin_step();
    const bool loaded = find_of_node(conditions_.loads, set.load.node) != nullptr;
    erase_of_node(conditions_.loads, set.load.node);
    if (!is_nothing(set.load)) {
      conditions_.loads.push_back(set.load);
    } else if (!loaded) {
      warn("node",
           fmt::format("nothing loads node {}: there is nothing to take away", set.load.node));
    }
  }
  void take(const SetElementLoad& set) {
    demand(set.load.element, document_.model_.elements.size(), "element");
    begin_step();
    const auto erased = std::erase_if(
        conditions_.distributed_loads,
        [&](const beams::DistributedLoad& load) { return load.element == set.load.element; });
    if (!set.load.force.isZero(0)) {
      conditions_.distributed_loads.push_back(set.load);
    } else if (erased == 0) {
      warn("element", fmt::format("nothing loads element {}: there is nothing to take away",
                                  set.load.element));
    }
  }
  void take(const PushNode& push) {
    demand_node(push.load.node);
    begin_step();
    conditions_.temporary_loads.push_back(push.load);
  }
  void take(const SetGravity& set) {
    begin_step();
    conditions_.gravity = set.gravity;
    for (const scene::Issue& issue : beam_remarks(with_conditions(document_.model_, conditions_))) {
      if (issue.field == "gravity") warn(issue.field, issue.message);
    }
  }
  void take(const Undo&) {
    close_step();
    history_.undo();
    conditions_ = *history_.now();
  }
  void take(const Redo&) {
    close_step();
    history_.redo();
    conditions_ = *history_.now();
  }

  /// Of what holds the node.
  [[nodiscard]] Eigen::Matrix3d axes_of(int node) {
    if (const BeamSupport* const support = find_of_node(conditions_.supports, node))
      return support->axes;
    if (const PrescribedMotion* const motion = find_of_node(conditions_.motions, node))
      return motion->axes;
    return Eigen::Matrix3d::Identity();
  }

  /// What the motion gives is no longer the support's; what it does not give stays.
  void bring(const PrescribedMotion& given) {
    demand_node(given.node);
    if (!given.translates_any() && !given.rotates_any())
      throw Error(ErrorCode::kInvalidArgument, "node",
                  fmt::format("the motion of node {} gives no direction", given.node));
    begin_step();
    PrescribedMotion motion = by_axes(given, axes_of(given.node)).value_or(given);
    if (BeamSupport* const support = find_of_node(conditions_.supports, motion.node)) {
      // By other axes than the support's it is refused.
      const bool fits = by_axes(motion, support->axes).has_value();
      for (std::size_t k = 0; fits && k < 3; ++k) {
        support->fixed[k] = support->fixed[k] && !motion.translates[k];
        support->fixed[3 + k] = support->fixed[3 + k] && !motion.rotates[k];
      }
      if (!holds_anything(*support)) erase_of_node(conditions_.supports, motion.node);
    }
    PrescribedMotion* const found = find_of_node(conditions_.motions, motion.node);
    found == nullptr ? conditions_.motions.push_back(motion) : add(motion, *found);
  }

  /// What one motion gives takes the place of what the other gives; the rest of that stays.
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
    if (!std::exchange(is_open_, true)) conditions_.temporary_loads.clear();
  }

  /// Refuses what the conditions may not be.
  void close_step() {
    if (!std::exchange(is_open_, false)) return;
    try {
      validate(with_conditions(document_.model_, conditions_));
    } catch (const Error& error) {
      throw Error(error.code(), last_name(error.field()), error.what());
    }
    history_.step_to(conditions_, document_.limits_.undo_depth, document_.limits_.undo_bytes,
                     [](const BeamConditions& conditions) { return bytes_of(conditions); });
  }

  const BeamDocument& document_;
  const Places& places_;
  History history_;
  BeamConditions conditions_;
  bool is_open_ = false;  // edits since the last step
  int edits_ = 0;         // taken
  std::vector<scene::Issue> warnings_;
};

BeamDocument::BeamDocument(beams::BeamModel model, BeamLimits limits)
    : model_(std::move(model)), limits_(limits), history_(conditions_of(model_)) {
  limits.validate();
  validate(model_);
}

EditReceipt BeamDocument::apply(const std::vector<BeamEdit>& edits,
                                std::optional<Revision> expected, const Places& places) {
  if (expected && *expected != revision_) {
    throw Error(ErrorCode::kFailedPrecondition, "expected_revision",
                fmt::format("the session is at revision {}, not {}", revision_, *expected));
  }
  if (edits.empty()) throw Error(ErrorCode::kInvalidArgument, "edits", "there are no edits");
  std::optional<History> done;
  std::vector<scene::Issue> warnings;
  try_edits(edits.size(), [&](std::size_t count) {
    Request request(*this, places);
    for (std::size_t i = 0; i < count; ++i) request.apply(edits[i]);
    done.emplace(request.finish());
    warnings = request.take_warnings();
  });
  LIMBER_DEMAND(done.has_value());
  history_ = std::move(*done);
  EditReceipt receipt;
  receipt.revision = ++revision_;
  receipt.issues = std::move(warnings);
  receipt.constraint_ids.assign(edits.size(), 0);
  receipt.keyframe_ids.assign(edits.size(), 0);
  return receipt;
}

}  // namespace limber::session
