#include "engine/session/beams/live_problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "engine/base/error.h"
#include "engine/beams/refinement/member_results.h"
#include "engine/beams/structure/node_loads.h"
#include "engine/session/beams/shape_cache.h"

namespace limber::session {
namespace {

using beams::BeamStatus;

constexpr int kMaxFrames = 128;               // of one path
constexpr int kMaxDoubledParts = 2;           // times, where elements do not resolve an edit
constexpr double kMinReportedShare = 0.0005;  // less is reported as 0 %
// Memory for the shapes that undo returns to, and the size of one.
constexpr std::size_t kKnownBytes = std::size_t{64} << 20;
constexpr std::size_t kBytesPerElement = 1000;

beams::Subdivision first_cut(const beams::BeamModel& model,
                             const beams::BeamDiscretisation& discretisation) {
  validate(model);
  discretisation.validate();
  return discretisation.first(model);
}

/// The report of a path, with the equilibrium replaced by the refined one.
beams::BeamReport continued_report(const beams::BeamReport& path,
                                   const beams::BeamReport& refined) {
  beams::BeamReport report = path;
  report.newton_iterations += refined.newton_iterations;
  report.factorizations += refined.factorizations;
  report.relaxation_steps += refined.relaxation_steps;
  report.residual = refined.residual;
  report.elastic_energy = refined.elastic_energy;
  report.negative_eigenvalues = refined.negative_eigenvalues;
  report.neutral_directions = refined.neutral_directions;
  report.unjudged_elements = refined.unjudged_elements;
  report.message = refined.message;
  return report;
}

}  // namespace

Eigen::VectorXd beam_coordinates(const beams::BeamState& state) {
  Eigen::VectorXd coordinates(7 * state.nodes());
  for (int i = 0; i < state.nodes(); ++i) {
    const Eigen::Quaterniond& q = state.rotations[static_cast<std::size_t>(i)];
    coordinates.segment<3>(7 * i) = state.positions.col(i);
    coordinates.segment<4>(7 * i + 3) = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  }
  return coordinates;
}

LiveBeams::LiveBeams(beams::BeamModel model, std::optional<beams::BeamState> shape,
                     beams::BeamDiscretisation discretisation)
    : model_(std::move(model)),
      discretisation_(discretisation),
      cut_(first_cut(model_, discretisation_)),
      state_(beams::BeamStructure(cut_model(model_, cut_)).rest_state()),
      good_{nullptr, cut_, state_, {}, nullptr} {
  if (!shape) return;
  const beams::BeamStructure structure(model_);
  if (shape->nodes() != structure.nodes() ||
      shape->rotations.size() != static_cast<std::size_t>(structure.nodes()) ||
      shape->hinge_turns.size() != structure.released_ends().size())
    throw Error(ErrorCode::kInvalidArgument, "shape", "shape is of another structure");
  const beams::Subdivision whole = beams::Subdivision::even(model_, 1);
  state_ = whole == cut_ ? std::move(*shape) : carry_state(structure, whole, *shape, cut_);
  turned_ = turns_at(conditions_of(model_), 1);
  is_drawn_ = false;
  given_ = Place{nullptr, cut_, state_, turned_, nullptr};
}

beams::BeamState LiveBeams::shown(const beams::BeamState& state) const {
  return without_parts(state, static_cast<int>(model_.nodes.size()));
}

void LiveBeams::set_cut(const beams::Subdivision& cut) {
  if (cut == cut_) return;
  state_ = is_drawn_
               ? beams::BeamStructure(cut_model(model_, cut)).rest_state()
               : carry_state(beams::BeamStructure(cut_model(model_, cut_)), cut_, state_, cut);
  cut_ = cut;
}

void LiveBeams::name_nodes(beams::BeamReport& report) const {
  if (report.node >= 0) report.node = cut_.nearest_node(report.node);
  for (beams::BeamSnap& snap : report.snaps) {
    if (snap.node >= 0) snap.node = cut_.nearest_node(snap.node);
  }
  for (beams::BeamNeutralDirection& direction : report.neutral_directions)
    direction.node = cut_.nearest_node(direction.node);
  std::vector<int>& elements = report.unjudged_elements;
  for (int& element : elements) element = cut_.element_of_part(element);
  elements.erase(std::unique(elements.begin(), elements.end()), elements.end());
}

/// Rotations of the held nodes, at a share of the path from their old to their requested values.
/// For nodes that were not held before, only the state is known.
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
    cut_ = place.cut;
    state_ = place.state;
    turned_ = place.turned;
    is_drawn_ = false;
    return true;
  }
  return false;
}

void LiveBeams::restore() {
  const Place& place = given_ ? *given_ : good_;
  cut_ = place.cut;
  state_ = place.state;
  turned_ = place.turned;
  is_drawn_ = !given_ && good_.conditions == nullptr;
}

void LiveBeams::keep(const SharedConditions& conditions, beams::BeamStructure&& structure,
                     beams::BeamSolution&& solution) {
  turned_ = turns_at(*conditions, 1);
  is_drawn_ = false;
  state_ = solution.state;
  beams::BeamResults results = member_results(results_of(structure, state_), cut_);
  if (!cut_.is_whole()) {
    structure = beams::BeamStructure(with_conditions(model_, *conditions));
    solution.state = shown(state_);
  }
  good_ = {conditions, cut_, state_, turned_,
           std::make_shared<const BeamAnalysis>(
               BeamAnalysis{std::move(structure), std::move(solution), std::move(results), {}})};
  estimate_.reset();
  next_cut_.reset();
  std::erase_if(known_, [&](const Place& place) {
    // Undo leads to the conditions that the document holds, by their address.
    return place.conditions == conditions || place.conditions.use_count() == 1;
  });
  known_.push_back(good_);
  known_.back().analysis.reset();
  std::size_t bytes = 0;
  for (const Place& place : known_)
    bytes += kBytesPerElement * static_cast<std::size_t>(std::max(1, place.cut.elements()));
  while (known_.size() > 1 && bytes > kKnownBytes) {
    bytes -=
        kBytesPerElement * static_cast<std::size_t>(std::max(1, known_.front().cut.elements()));
    known_.pop_front();
  }
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
  beams::BeamSolveOptions options;
  if (!is_drawn_) options = beams::BeamSolveOptions::live(structure.elements());
  // No edit waits for it: see check().
  if (!discretisation_.is_chosen()) options.finer_judgement = beams::FinerJudgement::kLeft;
  return is_drawn_ ? find_equilibrium(structure, options, job, observer)
                   : follow_equilibrium(structure, state_, turned_, options, job, observer, found);
}

LiveBeams::Outcome LiveBeams::solve_as_drawn(const SharedConditions& conditions,
                                             const JobContext& job, const OnIterate& on_iterate) {
  const beams::Subdivision cut = cut_;
  given_.reset();
  restore();
  set_cut(cut);
  Outcome outcome = solve_once(conditions, job, on_iterate);
  outcome.report.message += "; from the structure as drawn: its given shape led nowhere";
  return outcome;
}

LiveBeams::Outcome LiveBeams::solve(const SharedConditions& conditions, const JobContext& job,
                                    const OnIterate& on_iterate) {
  if (next_cut_) set_cut(*std::exchange(next_cut_, std::nullopt));
  beams::Subdivision tried = cut_;
  Outcome outcome = solve_once(conditions, job, on_iterate);
  for (int doubled = 0; doubled < kMaxDoubledParts; ++doubled) {
    if (outcome.reached || !outcome.report.is_unresolved || !discretisation_.is_chosen()) break;
    tried = tried.halved(model_);
    if (tried.elements() > discretisation_.max_elements) break;
    set_cut(tried);
    Outcome finer = solve_once(conditions, job, on_iterate);
    if (finer.reached || finer.report.status == BeamStatus::kCancelled) return finer;
  }
  return outcome;
}

LiveBeams::Outcome LiveBeams::solve_once(const SharedConditions& conditions, const JobContext& job,
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
  beams::BeamStructure structure(cut_model(model, cut_));
  ShapeCache<Eigen::VectorXd> keeper(kMaxFrames);
  const beams::BeamObserver observer = [&](const beams::BeamProgress& progress) {
    const beams::BeamState reached = shown(*progress.state);
    keeper.keep([&] { return beam_coordinates(reached); });
    on_iterate(reached);
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
  name_nodes(solution.report);
  Outcome outcome;
  outcome.report = solution.report;
  outcome.reached = solution.report.converged();
  if (outcome.reached) {
    keep(conditions, std::move(structure), std::move(solution));
    outcome.frames = keeper.take();
    const Eigen::VectorXd last = beam_coordinates(shown(state_));
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

std::shared_ptr<const DiscretisationCheck> LiveBeams::check(const JobContext& job) {
  LIMBER_DEMAND(good_.analysis != nullptr);
  const auto begin = std::chrono::steady_clock::now();
  estimate_ = estimate_discretisation(with_conditions(model_, *good_.conditions),
                                      {good_.cut, good_.state}, discretisation_.max_elements, job);
  auto check = std::make_shared<DiscretisationCheck>();
  check->error = estimate_->error;
  check->tolerance = discretisation_.tolerance;
  if (discretisation_.is_chosen() && check->error.is_known)
    next_cut_ = coarsened_where_possible(model_, good_.cut, estimate_->indicators,
                                         check->error.error_against(*discretisation_.tolerance),
                                         *discretisation_.tolerance);
  if (!discretisation_.is_chosen()) judge(job);
  check->check_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return check;
}

/// Does the part of the solve that was left to the check.
void LiveBeams::judge(const JobContext& job) {
  beams::BeamReport report = good_.analysis->solution.report;
  const beams::BeamStructure& whole = good_.analysis->structure;
  std::optional<beams::BeamStructure> cut;
  if (!good_.cut.is_whole()) cut.emplace(cut_model(whole.model(), good_.cut));
  judge_by_shorter_elements(cut ? *cut : whole, good_.state, report, job);
  if (report.converged() && report.unjudged_elements.empty()) return;
  name_nodes(report);
  auto judged = std::make_shared<BeamAnalysis>(*good_.analysis);
  judged->solution.report = std::move(report);
  good_.analysis = std::move(judged);
}

bool LiveBeams::refine(const JobContext& job) {
  if (!estimate_ || !estimate_->finest) return false;
  const std::optional<beams::Subdivision> chosen =
      refined_where_needed(model_, good_.cut, estimate_->indicators, discretisation_.max_elements);
  if (!chosen) return false;
  const beams::CutEquilibrium finest = *estimate_->finest;
  beams::BeamModel model = with_conditions(model_, *good_.conditions);
  model.temporary_loads.clear();
  const beams::BeamStructure fine(cut_model(model, finest.subdivision));
  // The finest one is an equilibrium; between that and the last one the chosen one should have one.
  for (const beams::Subdivision& cut : {*chosen, finest.subdivision}) {
    beams::BeamStructure structure(cut_model(model, cut));
    beams::BeamSolveOptions options;
    if (cut == *chosen && !beams::NodeLoads::of(model).follows())
      options.method = beams::BeamMethod::kNewton;  // a relaxation would go somewhere else, slowly
    beams::BeamSolution solution = find_equilibrium_from(
        structure, carry_state(fine, finest.subdivision, finest.state, cut), options, job);
    job.throw_if_cancelled();
    if (!solution.report.converged()) continue;
    cut_ = cut;
    name_nodes(solution.report);
    solution.report = continued_report(good_.analysis->solution.report, solution.report);
    const SharedConditions conditions = good_.conditions;
    keep(conditions, std::move(structure), std::move(solution));
    return true;
  }
  return false;
}

}  // namespace limber::session
