#include "engine/session/beams/live_beams.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "engine/base/error.h"
#include "engine/session/beams/shape_cache.h"

namespace limber::session {
namespace {

using beams::BeamStatus;

constexpr int kMaxFrames = 128;               // of one path
constexpr double kMinReportedShare = 0.0005;  // less is reported as 0 %
// Shapes that undo comes back to, and what one takes of memory.
constexpr std::size_t kKnownBytes = std::size_t{64} << 20;
constexpr std::size_t kBytesPerElement = 1000;

}  // namespace

Eigen::VectorXf beam_coordinates(const beams::BeamState& state) {
  Eigen::VectorXf coordinates(7 * state.nodes());
  for (int i = 0; i < state.nodes(); ++i) {
    const Eigen::Quaterniond& q = state.rotations[static_cast<std::size_t>(i)];
    coordinates.segment<3>(7 * i) = state.positions.col(i).cast<float>();
    coordinates.segment<4>(7 * i + 3) = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()).cast<float>();
  }
  return coordinates;
}

LiveBeams::LiveBeams(beams::BeamModel model, std::optional<beams::BeamState> shape)
    : model_(std::move(model)), state_(beams::BeamStructure(model_).rest_state()) {
  good_.state = state_;
  if (!shape) return;
  if (shape->nodes() != state_.nodes() || shape->rotations.size() != state_.rotations.size() ||
      shape->hinge_turns.size() != state_.hinge_turns.size())
    throw Error(ErrorCode::kInvalidArgument, "shape", "shape is of another structure");
  state_ = std::move(*shape);
  turned_ = turns_at(conditions_of(model_), 1);
  is_drawn_ = false;
  given_ = Place{nullptr, state_, turned_, nullptr};
}

/// What the held nodes have turned by, a share of the path from where they were to what conditions
/// ask for. Of nodes that were not held before nothing is known but the state.
LiveBeams::Turns LiveBeams::turns_at(const BeamConditions& conditions, double share) const {
  Turns turns;
  const auto note = [&](int node, const Eigen::Vector3d& target) {
    const auto before = std::find_if(turned_.begin(), turned_.end(),
                                     [node](const beams::HeldTurn& t) { return t.node == node; });
    const bool was_held = before != turned_.end() || is_drawn_;
    if (share < 1 && !was_held) return;
    const Eigen::Vector3d from =
        before != turned_.end() ? before->rotation : Eigen::Vector3d::Zero().eval();
    turns.push_back({node, from + share * (target - from)});
  };
  std::set<int> turned_by_motions;
  for (const beams::PrescribedMotion& motion : conditions.motions) {
    if (!motion.rotates_any()) continue;
    note(motion.node, motion.axes * by_axes(motion, motion.axes)->rotation);
    turned_by_motions.insert(motion.node);
  }
  for (const beams::BeamSupport& support : conditions.supports) {
    if ((support.fixed[3] || support.fixed[4] || support.fixed[5]) &&
        !turned_by_motions.contains(support.node))
      note(support.node, Eigen::Vector3d::Zero());
  }
  return turns;
}

bool LiveBeams::begin_at(const SharedConditions& conditions) {
  for (const Place& place : known_) {
    if (place.conditions != conditions) continue;
    state_ = place.state;
    turned_ = place.turned;
    is_drawn_ = false;
    return true;
  }
  return false;
}

void LiveBeams::restore() {
  const Place& place = given_ ? *given_ : good_;
  state_ = place.state;
  turned_ = place.turned;
  is_drawn_ = !given_ && good_.conditions == nullptr;
}

void LiveBeams::keep(const SharedConditions& conditions, beams::BeamStructure&& structure,
                     beams::BeamSolution&& solution) {
  turned_ = turns_at(*conditions, 1);
  is_drawn_ = false;
  state_ = solution.state;
  beams::BeamResults results = results_of(structure, state_);
  good_ = {conditions, state_, turned_,
           std::make_shared<const BeamAnalysis>(
               BeamAnalysis{std::move(structure), std::move(solution), std::move(results), {}})};
  std::erase_if(known_, [&](const Place& place) { return place.conditions == conditions; });
  known_.push_back(good_);
  known_.back().analysis.reset();
  const std::size_t each = kBytesPerElement * std::max<std::size_t>(1, model_.elements.size());
  while (known_.size() > 1 && known_.size() * each > kKnownBytes) known_.pop_front();
}

/// Load steps are states that the next solve may continue from; what a relaxation was doing is not.
void LiveBeams::keep_path_state(const BeamConditions& conditions,
                                const beams::BeamSolution& solution) {
  const beams::BeamReport& report = solution.report;
  if (report.method != beams::BeamMethod::kNewton || report.load_steps == 0) return;
  turned_ = turns_at(conditions, report.load_factor);
  is_drawn_ = false;
  state_ = solution.state;
}

beams::BeamSolution LiveBeams::settle(const beams::BeamStructure& structure,
                                      beams::FoundUnder found, const JobContext& job,
                                      const beams::BeamObserver& observer) const {
  return is_drawn_ ? find_equilibrium(structure, {}, job, observer)
                   : follow_equilibrium(structure, state_, turned_,
                                        beams::BeamSolveOptions::live(structure.elements()), job,
                                        observer, found);
}

LiveBeams::Outcome LiveBeams::solve_as_drawn(const SharedConditions& conditions,
                                             const JobContext& job, const OnIterate& on_iterate) {
  given_.reset();
  restore();
  Outcome outcome = solve(conditions, job, on_iterate);
  outcome.report.message += "; from the structure as drawn: its given shape led nowhere";
  return outcome;
}

LiveBeams::Outcome LiveBeams::solve(const SharedConditions& conditions, const JobContext& job,
                                    const OnIterate& on_iterate) {
  beams::BeamModel model = with_conditions(model_, *conditions);
  const bool is_given = given_.has_value();
  const bool was_solved = begin_at(conditions);
  if (was_solved) {
    model.temporary_loads.clear();  // a side that was chosen before is not chosen again
  } else if (!is_given && good_.conditions == nullptr) {
    model.temporary_loads.insert(model.temporary_loads.end(), model_.temporary_loads.begin(),
                                 model_.temporary_loads.end());
  }
  beams::BeamStructure structure(std::move(model));
  ShapeCache<Eigen::VectorXf> keeper(kMaxFrames);
  const beams::BeamObserver observer = [&](const beams::BeamProgress& progress) {
    keeper.keep([&] { return beam_coordinates(*progress.state); });
    on_iterate(*progress.state);
  };
  beams::BeamSolution solution;
  try {
    solution = settle(
        structure,
        was_solved ? beams::FoundUnder::kTheseConditions : beams::FoundUnder::kOtherConditions, job,
        observer);
  } catch (const std::exception&) {
    if (!is_given) throw;
    return solve_as_drawn(conditions, job, on_iterate);
  }
  if (is_given && solution.report.status != BeamStatus::kCancelled) {
    if (!solution.report.converged()) return solve_as_drawn(conditions, job, on_iterate);
    given_.reset();
  }
  Outcome outcome;
  outcome.report = solution.report;
  outcome.reached = solution.report.converged();
  if (outcome.reached) {
    keep(conditions, std::move(structure), std::move(solution));
    outcome.frames = keeper.take();
    const Eigen::VectorXf last = beam_coordinates(state_);
    if (outcome.frames.empty() || outcome.frames.back() != last) outcome.frames.push_back(last);
  } else if (solution.report.status == BeamStatus::kCancelled) {
    keep_path_state(*conditions, solution);
  } else {
    if (!is_drawn_) {
      outcome.report.load_factor = outcome.report.equilibrium_share.value_or(0);
      if (outcome.report.load_factor < kMinReportedShare)
        outcome.report.message += "; the shape before this change is the last equilibrium";
    }
    if (outcome.report.load_factor < 1)
      outcome.report.message =
          fmt::format("Stopped at {:.3g} % of the requested change: {}",
                      100 * outcome.report.load_factor, outcome.report.message);
    restore();
  }
  return outcome;
}

}  // namespace limber::session
