#include "engine/rods/equilibrium/rest_length_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/base/error.h"
#include "engine/base/numerics/line_search.h"
#include "engine/base/numerics/raise_shift.h"
#include "engine/rods/equilibrium/equilibrium_text.h"

namespace limber::rods::detail {
namespace {

constexpr double kShortestStepFraction = 1e-8;    // of a step: shorter ones are not tried
constexpr double kResidualRounding = 1e-13;       // of the energy
constexpr double kGrowth = 8;                     // of shifts
constexpr double kShortestEdge = 1e-3;            // of joints, as a share of rest
constexpr double kLargestTurnOfLengthStep = 0.5;  // of a step [rad]
constexpr int kShifts = 59;                       // shifts that are tried at most

}  // namespace

RestLengthRun::RestLengthRun(LinkageModel& model, LinkageState& state,
                             const RestLengthOptions& options, const JobContext& context)
    : model_(model),
      state_(state),
      options_(options),
      context_(context),
      scales_(model),
      assembly_(model),
      derivatives_(model),
      matrix_(model.chains()),
      system_(model),
      low_(options.shortest * drawn_lengths(model.graph())),
      high_(options.longest * drawn_lengths(model.graph())),
      active_(static_cast<std::size_t>(low_.size()), 0) {
  pin_positions();
  system_.set_shift_weights(scales_.weights());
}

/// Joints, and ends of rods without joints, stay where they are drawn.
void RestLengthRun::pin_positions() {
  const ReducedVariables& variables = model_.variables();
  const auto pin = [&](int first) {
    for (int axis = 0; axis < 3; ++axis) pinned_.push_back(first + axis);
  };
  for (int s = 0; s < variables.segments(); ++s) {
    const Segment& segment = model_.graph().segments[s];
    if (segment.joints[kStart] < 0) pin(variables.position(s, 0));
    if (segment.joints[kFinish] < 0) pin(variables.position(s, variables.edges(s)));
  }
  for (int j = 0; j < variables.joints(); ++j) pin(variables.joint_begin(j) + kJointPosition);
  is_pinned_.assign(static_cast<std::size_t>(variables.size()), 0);
  for (const int unknown : pinned_) is_pinned_[unknown] = 1;
  system_.set_pinned(pinned_);
}

RestLengthReport RestLengthRun::run() {
  const auto finish = [&](RestLengthStatus status, std::string message) {
    report_.status = status;
    report_.message = std::move(message);
    return report_;
  };
  const auto unbalanced_text = [&](const char* end) {
    return fmt::format(
        "{} after {} steps: the forces are out of balance by {:.2g} % of the largest "
        "(limit {:.2g} %); use rest lengths as drawn, or draw smoother rods",
        end, report_.iterations, 100 * report_.max_gradient_scaled, 100 * options_.tolerance);
  };
  evaluate();
  report_.before = report_.energies;
  first_imbalance_ = report_.max_gradient_scaled;
  for (;;) {
    if (context_.cancellation.requested())
      return finish(RestLengthStatus::kCancelled, "cancelled by the caller");
    if (!std::isfinite(report_.energies.total())) {
      return finish(RestLengthStatus::kStalled, degenerate_text(model_, state_));
    }
    if (balanced()) {
      return finish(RestLengthStatus::kConverged,
                    fmt::format("balanced to {:.1e}", report_.max_gradient_scaled));
    }
    if (report_.iterations == options_.max_iterations) {
      return finish(RestLengthStatus::kIterationLimit, unbalanced_text("the stress is not least"));
    }
    ++report_.iterations;
    if (!improve()) {
      if (context_.cancellation.requested()) continue;
      return finish(RestLengthStatus::kStalled, unbalanced_text("the search is stuck"));
    }
    if (context_.progress) context_.progress("rest lengths", progress());
  }
}

/// By the orders of magnitude that the imbalance has to fall; never back.
double RestLengthRun::progress() {
  const double whole = std::log(first_imbalance_ / options_.tolerance);
  const double done = std::log(first_imbalance_ / report_.max_gradient_scaled);
  if (whole > 0 && done > 0) progress_ = std::max(progress_, std::min(1.0, done / whole));
  return progress_;
}

/// Makes a step, if there is one and no stop is requested before it.
bool RestLengthRun::improve() {
  try {
    return factor() && take(solve({-gradient_.unknowns, -gradient_.lengths}));
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kCancelled) throw;
    return false;
  }
}

void RestLengthRun::evaluate() {
  report_.energies = assembly_.energies(state_);
  gradient_ = derivatives_.gradient({state_});
  for (const int unknown : pinned_) gradient_.unknowns[unknown] = 0;
  set_active();
  const GradientSize size = scales_.size_of(gradient_.unknowns);
  double pull = size.force;
  for (Eigen::Index s = 0; s < low_.size(); ++s) {
    const double own = std::abs(gradient_.lengths[s]);
    if (active_[s] == 0 && !(own <= pull)) pull = own;
  }
  GradientSize scale = scales_.present(report_.energies);
  scale.force += scales_.force_rounding() / options_.tolerance;
  scale.moment += scales_.moment_rounding() / options_.tolerance;
  report_.max_gradient_scaled = std::max(pull / scale.force, size.moment / scale.moment);
}

bool RestLengthRun::balanced() const { return report_.max_gradient_scaled <= options_.tolerance; }

/// Lengths on a bound that would go past it.
void RestLengthRun::set_active() {
  const Eigen::VectorXd& lengths = model_.segment_lengths();
  report_.at_bound.clear();
  for (int s = 0; s < static_cast<int>(active_.size()); ++s) {
    const bool past = (lengths[s] <= low_[s] && gradient_.lengths[s] > 0) ||
                      (lengths[s] >= high_[s] && gradient_.lengths[s] < 0);
    active_[s] = past ? 1 : 0;
    if (past) report_.at_bound.push_back(s);
  }
}

/// Second derivatives at the iterate, shifted until they are positive.
bool RestLengthRun::factor() {
  Eigen::VectorXd unused(gradient_.unknowns.size());
  (void)assembly_.hessian(state_, unused, matrix_);
  mixed_ = derivatives_.by_lengths({state_}, context_);
  // Without the rows of fixed unknowns.
  mixed_.unknowns.prune(
      [&](Eigen::Index row, Eigen::Index, double) { return is_pinned_[row] == 0; });
  const double first = std::max(
      {shift_ / (kGrowth * kGrowth), scales_.softest_eigenvalue(), scales_.rounding_shift()});
  const auto factors = [&](double shift) { return factor_shifted(shift); };
  const std::optional<double> shift =
      factors(0) ? 0.0 : raise_shift({first, kGrowth, kShifts}, factors);
  if (shift) shift_ = *shift;
  return shift.has_value();
}

bool RestLengthRun::factor_shifted(double shift) {
  ++report_.factorizations;
  context_.throw_if_cancelled();
  return system_.factor(matrix_, mixed_, shift, model_.rest_lengths().free_edge.mean(), active_);
}

/// With the factor at hand; nothing for lengths on their bounds.
LinkageVector RestLengthRun::solve(const LinkageVector& right_side) {
  LinkageVector x = right_side;
  for (const int unknown : pinned_) x.unknowns[unknown] = 0;
  system_.solve_in_place(x);
  return x;
}

/// How much of a step keeps lengths within their bounds.
double RestLengthRun::room(const LinkageVector& step) const {
  double fraction = 1;
  for (Eigen::Index s = 0; s < step.lengths.size(); ++s) {
    const double change = step.lengths[s], length = model_.segment_lengths()[s];
    const double bound = change < 0 ? low_[s] : high_[s];
    if (std::abs(change) > std::abs(bound - length))
      fraction = std::min(fraction, (bound - length) / change);
  }
  return fraction;
}

/// Holds lengths on a bound that a step would take past it.
bool RestLengthRun::block(const LinkageVector& step) {
  bool any = false;
  for (Eigen::Index s = 0; s < step.lengths.size(); ++s) {
    const double change = step.lengths[s], length = model_.segment_lengths()[s];
    if (active_[s] != 0 || change == 0) continue;
    const double left = (change < 0 ? low_[s] : high_[s]) - length;
    if (std::abs(left) > kShortestStepFraction * std::abs(change)) continue;
    active_[s] = 1;
    any = true;
  }
  return any;
}

/// Along a step, or along the curve that keeps to second order what the step balances.
bool RestLengthRun::take(const LinkageVector& newton) {
  LinkageVector step = newton;
  while (block(step)) {
    if (!factor_shifted(shift_)) return false;
    step = solve({-gradient_.unknowns, -gradient_.lengths});
  }
  const double energy = report_.energies.total();
  const SufficientDecrease decrease{
      energy, gradient_.unknowns.dot(step.unknowns) + gradient_.lengths.dot(step.lengths),
      kResidualRounding * energy + scales_.energy_rounding()};
  const double allowed = std::min(
      room(step),
      kLargestTurnOfLengthStep /
          std::max(kLargestTurnOfLengthStep, scales_.largest_turn(model_, state_, step.unknowns)));
  LinkageVector bend;
  const auto attempt = [&](double fraction) {
    LinkageVector part{fraction * step.unknowns, fraction * step.lengths};
    if (bend.unknowns.size() > 0) {
      part.unknowns += 0.5 * fraction * fraction * bend.unknowns;
      part.lengths += 0.5 * fraction * fraction * bend.lengths;
    }
    if (try_step(part, decrease.bound(fraction))) return StepVerdict::accept();
    if (bend.unknowns.size() > 0) return StepVerdict::retry(fraction / 2);
    const LinkageVector third = derivatives_.third({state_}, step, step);
    bend = solve({-third.unknowns, -third.lengths});
    return StepVerdict::retry(fraction);
  };
  return backtrack({allowed, kShortestStepFraction}, attempt).is_accepted;
}

/// Goes there if it is allowed and low enough.
bool RestLengthRun::try_step(const LinkageVector& step, double energy_below) {
  const Eigen::VectorXd before = model_.segment_lengths();
  const Eigen::VectorXd after = (before + step.lengths).cwiseMax(low_).cwiseMin(high_);
  if (!(model_.rest_length_map().apply_to_change(after).free_edge.minCoeff() > 0)) return false;
  LinkageState trial = state_.moved(model_, step.unknowns);
  model_.set_segment_lengths(after);
  if (is_short(trial) || !(assembly_.energies(trial).total() <= energy_below)) {
    model_.set_segment_lengths(before);
    return false;
  }
  state_ = std::move(trial);
  evaluate();
  return true;
}

/// Whether an edge of a joint has all but vanished.
bool RestLengthRun::is_short(const LinkageState& trial) const {
  for (std::size_t j = 0; j < trial.joints().size(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const double rest = model_.rest_lengths().terminal(rod, static_cast<Eigen::Index>(j));
      if (std::isfinite(rest) && !(trial.joints()[j].lengths[rod] > kShortestEdge * rest))
        return true;
    }
  }
  return false;
}

}  // namespace limber::rods::detail
