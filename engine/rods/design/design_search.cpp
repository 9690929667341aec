#include "engine/rods/design/design_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/rods/design/design_text.h"

namespace limber::rods::detail {
namespace {

// Trust region. A step that gains this share of the gain that the model promised is accepted; below
// and above the next two the region shrinks and grows.
constexpr double kTaken = 1e-4;
constexpr double kPoorDesignModel =
    0.25;  // ratio of gain to prediction below which the radius shrinks
constexpr double kGoodDesignModel = 0.75;    // the same, above which it grows
constexpr double kShrink = 0.25;             // factor of the radius, or of a step that failed
constexpr double kGrow = 2;                  // factor of the radius
constexpr double kLeastDesignRadius = 1e-9;  // of the mean length
// Share of a slope that conjugate gradients may leave: at most, and if an end depends on it.
constexpr double kMaxLinearResidual = 0.1;
constexpr double kLeastLeft = 1e-3;  // smallest share that is required
constexpr double kInner = 1e-2;      // gradient at which multipliers are updated
constexpr int kIdle = 10;
// Trials not believed more than believed, after which nothing is remembered of curvatures.
constexpr int kAstray = 3;
constexpr int kUpdates = 30;  // of multipliers
// Guard against buckling. If a flat shape is lost below this share of the last good radius, the
// guard goes up; the radius where it is lowered begins at a share of the first.
constexpr double kLostRadius = 0.03;
constexpr double kLoweredRadius = 0.03;  // of the first radius
// It is lowered after so many steps, or where the gradient has come to a share of that at its last
// change, if it hinders.
constexpr int kHeld = 5;
constexpr double kSettledGuard = 0.1;  // of the gradient at the last change
constexpr double kNoEnergy = 1e-12;    // share of the scale of energies that is rounding
// Searches for another branch where one ends: from a point, and from all.
constexpr int kMaxBranchAttemptsPerPoint = 3;
constexpr int kMaxBranchAttempts = 20;  // of one search

double mean_length(const LinkageDesign& design) {
  const int lengths = design.variables().lengths();
  return lengths > 0 ? design.parameters().head(lengths).mean() : design.point().lengths.mean();
}

/// Factors that give all parameters one unit, that of lengths.
Eigen::VectorXd units(const LinkageDesign& design) {
  Eigen::VectorXd result = Eigen::VectorXd::Ones(design.parameters().size());
  result.tail(design.variables().sections()).setConstant(mean_length(design));
  return result;
}

double promise_of(const Eigen::VectorXd& slope, const ModelStep& step) {
  return -(slope.dot(step.p) + 0.5 * step.p.dot(step.bent));
}

}  // namespace

DesignSearch::DesignSearch(LinkageDesign& design, const DesignOptimizerOptions& options,
                           DesignBounds bounds)
    : design_(design),
      options_(options),
      merit_(design, options),
      bounds_(std::move(bounds)),
      units_(units(design)),
      mean_length_(mean_length(design)),
      first_radius_(options.first_radius * mean_length_ *
                    std::sqrt(static_cast<double>(bounds_.low.size()))),
      radius_(first_radius_),
      good_radius_(first_radius_) {}

DesignReport DesignSearch::run(const JobContext& context, const DesignCallback& on_step,
                               const DesignEndCallback& on_end) {
  begin_goal();
  report_.before = values_;
  for (;;) {
    while (step(context, on_step)) continue;
    report_end();
    if (on_end) on_end(report_, design_);
    if (design_.criteria_revision() == goal_) return report_;
    begin_goal();
  }
}

void DesignSearch::report_end() {
  return_to_best();
  if (report_.status == DesignStatus::kInfeasible && merit_.rank(values_).holds()) {
    report_.status = DesignStatus::kSettled;
    report_.message =
        "nearer designs violate a constraint: to come nearer, allow a larger flat height, a "
        "smaller "
        "least angle or less cover";
  }
  report_.after = values_;
  report_.flat_height = merit_.flat_height(values_);
  const Eigen::VectorXd& parameters = design_.parameters();
  report_.at_bound.clear();
  for (Eigen::Index s = 0; s < parameters.size(); ++s)
    if (parameters[s] <= bounds_.low[s] || parameters[s] >= bounds_.high[s])
      report_.at_bound.push_back(static_cast<int>(s));
  report_remarks();
}

/// Nothing that was learned of other criteria holds for these.
void DesignSearch::begin_goal() {
  goal_ = design_.criteria_revision();
  values_ = design_.values(design_.point());
  merit_.begin();
  memory_.forget();
  watch_ = {};
  idle_ = astray_ = paused_ = updates_ = held_ = 0;
  widen(first_radius_);
  best_.clear();
  best_.note(design_.point(), merit_.rank(values_));
  safe_.reset();
  // Not of a constraint that is violated beyond all measure, beside which anything is small.
  first_gradient_ = projected(design_.gradients(LinkageDesign::Which::kObjective).objective).norm();
  if (first_gradient_ == 0) first_gradient_ = projected(merit_.gradient(values_)).norm();
  if (options_.guard == BucklingGuard::kFromStart) {
    merit_.guard().raise_at_once(values_.objective, flat_energy());
    safe_ = design_.point();
    ++report_.guard_raised;
  }
}

Eigen::VectorXd DesignSearch::product(const Eigen::VectorXd& v) {
  ++report_.products;
  return merit_.product(values_, v.cwiseQuotient(units_)).cwiseQuotient(units_);
}

/// Energy that measures the guard. Rounding is no measure: the scale of energies replaces it.
double DesignSearch::flat_energy() const {
  const double scale = design_.criteria().energy_scale;
  return values_.flat_energy > kNoEnergy * scale ? values_.flat_energy : scale;
}

/// A gain that is worth a step.
double DesignSearch::worth() const { return options_.least_gain * std::abs(values_.objective); }

/// Part of a descent that the bounds allow.
Eigen::VectorXd DesignSearch::projected(Eigen::VectorXd gradient) const {
  gradient = gradient.cwiseQuotient(units_);
  const Eigen::VectorXd& parameters = design_.parameters();
  for (Eigen::Index s = 0; s < gradient.size(); ++s) {
    if ((parameters[s] <= bounds_.low[s] && gradient[s] > 0) ||
        (parameters[s] >= bounds_.high[s] && gradient[s] < 0))
      gradient[s] = 0;
  }
  return gradient;
}

/// Soft directions may also buckle: after that, steps are measured by lengths for a while.
/// @param left  share of the slope that may remain
ModelStep DesignSearch::newton_step(const Eigen::VectorXd& slope, double left) {
  CurvatureMemory unused;
  return trust_region_step(
      slope, {radius_in_memory(), left * slope.norm(), options_.max_products},
      [this](const Eigen::VectorXd& v) { return product(v); }, paused_ > 0 ? unused : memory_);
}

/// @returns nothing where Newton's method, carried on, says that none near by is worth taking
std::optional<ModelStep> DesignSearch::worthwhile_step(const Eigen::VectorXd& slope) {
  ModelStep step =
      newton_step(slope, std::min(kMaxLinearResidual, std::sqrt(slope.norm() / first_gradient_)));
  if (!step.complete || promise_of(slope, step) > worth()) return step;
  // Soft directions come late.
  step = newton_step(slope, kLeastLeft);
  if (!step.complete || promise_of(slope, step) > worth()) return step;
  return {};
}

/// The radius is a length: as the last step's, by which both measures are compared.
double DesignSearch::radius_in_memory() const {
  if (memory_.empty() || last_step_.size() == 0) return radius_;
  return radius_ * memory_.size(last_step_) / last_step_.norm();
}

/// @returns whether there is a next one
bool DesignSearch::step(const JobContext& context, const DesignCallback& on_step) {
  if (context.cancellation.requested()) return end(DesignStatus::kCancelled, "cancelled");
  if (report_.iterations == options_.max_iterations)
    return end(
        DesignStatus::kIterationLimit,
        fmt::format("the limit of {} steps was reached: start again from the best design, or "
                    "allow more steps",
                    report_.iterations));
  if (hopeless()) return end(DesignStatus::kInfeasible, kNothingNearer);
  const Eigen::VectorXd slope = projected(merit_.gradient(values_));
  const double size = first_gradient_ > 0 ? slope.norm() / first_gradient_ : 0;
  if (size <= options_.tolerance || (size <= kInner && !merit_.settled(values_)))
    return arrived("the gradient is small");
  std::optional<ModelStep> model = worthwhile_step(slope);
  if (!model) return arrived("no step nearby gains a relevant amount");
  ++report_.iterations;
  const Eigen::VectorXd& here = design_.parameters();
  const Eigen::VectorXd unbounded = here + model->p.cwiseQuotient(units_);
  const Eigen::VectorXd tried = unbounded.cwiseMax(bounds_.low).cwiseMin(bounds_.high);
  if (tried != unbounded) {
    model->p = (tried - here).cwiseProduct(units_);
    model->bent = product(model->p);
  }
  DesignTrial trial = design_.trial(tried, context);
  report_.newton_steps += trial.iterations;
  if (trial.status == TrialStatus::kCancelled) return end(DesignStatus::kCancelled, "cancelled");
  bool taken = judge(trial, model->p.norm(), promise_of(slope, *model), model->at_rim);
  if (trial.lost == LostShape::kDeployed && radius_ < kLostRadius * good_radius_)
    taken = leave_branch(tried, trial, context);
  last_step_ = std::move(model->p);
  if (context.progress)
    context.progress("designing", report_.iterations / double(options_.max_iterations));
  if (run_callback(trial, taken, size, on_step)) return true;
  if (radius_ < kLeastDesignRadius * mean_length_) {
    if (trial.status == TrialStatus::kFound)
      return idle(DesignStatus::kSettled, "no smaller step gains anything");
    return idle(DesignStatus::kStuck, stuck_text(trial));
  }
  if (idle_ < kIdle) return true;
  return idle(DesignStatus::kSettled, "ten steps gained hardly anything");
}

/// @returns whether there is another goal now
bool DesignSearch::run_callback(const DesignTrial& trial, bool taken, double gradient,
                                const DesignCallback& on_step) {
  if (!on_step) return false;
  on_step({report_.iterations, values_, merit_.flat_height(values_), radius_, gradient, taken,
           trial.status == TrialStatus::kFound ? std::string() : trial.message, report_.refused,
           report_.not_believed, report_.flat_lost, merit_.guard().weight()},
          design_);
  if (design_.criteria_revision() == goal_) return false;
  begin_goal();
  return true;
}

/// Has the search arrived, because neither gradient nor model wants to move any more?
bool DesignSearch::arrived(const std::string& message) {
  if (lower_guard()) return true;
  if (merit_.settled(values_)) return end(DesignStatus::kConverged, message);
  if (update_multipliers()) return true;
  if (!merit_.rank(values_).holds()) return end(DesignStatus::kInfeasible, kNothingNearer);
  return end(DesignStatus::kSettled, "the constraints hold, with a margin");
}

/// Nothing moves any more: at an end only if the constraints hold.
bool DesignSearch::idle(DesignStatus status, const std::string& message) {
  if (status == DesignStatus::kSettled && lower_guard()) return true;
  if (status == DesignStatus::kStuck || merit_.settled(values_)) return end(status, message);
  if (!update_multipliers()) {
    return merit_.rank(values_).holds() ? end(status, message)
                                        : end(DesignStatus::kInfeasible, kNothingNearer);
  }
  idle_ = 0;
  radius_ = std::max(radius_, 1e-3 * mean_length_);
  return true;
}

void DesignSearch::not_believed(const DesignTrial& trial) {
  ++report_.not_believed;
  if (++astray_ >= kAstray) {
    memory_.forget();
    paused_ = pause_;
    pause_ *= 2;
    astray_ = 0;
  }
  if (trial.lost != LostShape::kFlat) return;
  ++report_.flat_lost;
  if (radius_ < kLostRadius * good_radius_ && options_.guard != BucklingGuard::kNever)
    raise_guard();
}

/// For a path that begins anew: earlier rejected predictions do not apply to it.
void DesignSearch::widen(double least) { good_radius_ = radius_ = std::max(radius_, least); }

/// @returns whether the trial is where the search continues
bool DesignSearch::judge(DesignTrial& trial, double length, double promised, bool at_rim) {
  if (trial.status != TrialStatus::kFound) {
    radius_ = kShrink * length;
    not_believed(trial);
    return false;
  }
  astray_ = std::max(0, astray_ - 1);
  paused_ = std::max(0, paused_ - 1);
  const DesignValues values = design_.values(trial.point);
  const double gained = merit_.value(values_) - merit_.value(values);
  const double ratio = promised > 0 ? gained / promised : -1;
  if (ratio < kPoorDesignModel) radius_ = kShrink * length;
  if (ratio > kGoodDesignModel && at_rim) radius_ = kGrow * std::max(length, radius_);
  if (!(ratio > kTaken)) {
    ++report_.refused;
    return false;
  }
  idle_ = gained < worth() ? idle_ + 1 : 0;
  accept(std::move(trial.point), values);
  good_radius_ = std::max(good_radius_, radius_);
  watch_guard();
  return true;
}

void DesignSearch::accept(DesignPoint point, const DesignValues& values) {
  ++report_.accepted;
  branch_attempts_here_ = 0;
  values_ = values;
  design_.move_to(std::move(point));
  best_.note(design_.point(), merit_.rank(values_));
}

/// Continues from the branch that the deployed shape falls to at the end of its own, if that is
/// worth more. @returns whether it does; `trial` is then the one that led there
bool DesignSearch::leave_branch(const Eigen::VectorXd& parameters, DesignTrial& trial,
                                const JobContext& context) {
  if (branch_attempts_here_ == kMaxBranchAttemptsPerPoint || branch_attempts_ == kMaxBranchAttempts)
    return false;
  ++branch_attempts_here_;
  ++branch_attempts_;
  DesignTrial fallen = design_.trial(parameters, context, Landing::kDeployedAnywhere);
  report_.newton_steps += fallen.iterations;
  if (fallen.status != TrialStatus::kFound) return false;
  const DesignValues values = design_.values(fallen.point);
  if (!(merit_.value(values) < merit_.value(values_))) return false;
  ++report_.branches_left;
  accept(fallen.point, values);
  memory_.forget();
  idle_ = astray_ = 0;
  widen(kLoweredRadius * first_radius_);
  trial = std::move(fallen);
  return true;
}

/// After a step that was taken.
void DesignSearch::watch_guard() {
  if (merit_.guard().weight() == 0) return;
  const double now = projected(merit_.gradient(values_)).norm();
  if (held_ == 0) guarded_gradient_ = now;
  if (++held_ < kHeld && now >= kSettledGuard * guarded_gradient_) return;
  if (merit_.guard().hinders(values_.objective, flat_energy())) {
    (void)lower_guard();
    return;
  }
  safe_ = design_.point();
}

void DesignSearch::raise_guard() {
  held_ = 0;
  if (!merit_.guard().raise(values_.objective, flat_energy())) return;
  ++report_.guard_raised;
  if (safe_) {  // where buckling begins no step is small enough to lead away
    design_.move_to(*safe_);
    values_ = design_.values(design_.point());
    radius_ = kLoweredRadius * first_radius_;
  }
  good_radius_ = radius_;
  idle_ = 0;
}

/// @returns whether it was up
bool DesignSearch::lower_guard() {
  if (merit_.guard().weight() == 0) return false;
  merit_.guard().lower();
  safe_ = design_.point();
  held_ = idle_ = 0;
  widen(kLoweredRadius * first_radius_);
  return true;
}

/// The guard's own weight may take the objective uphill for a while, a constraint's as well.
void DesignSearch::return_to_best() {
  if (!best_.point()) return;
  design_.move_to(*best_.point());
  values_ = design_.values(design_.point());
}

/// Is a constraint violated, and no less so for long, under any penalty weight?
bool DesignSearch::hopeless() {
  using Verdict = ViolationWatch::Verdict;
  const Verdict verdict = watch_.see(merit_.rank(values_).violation, report_.iterations);
  return verdict == Verdict::kHopeless || (verdict == Verdict::kRaise && !update_multipliers());
}

/// @returns false where that has been of no use for long
bool DesignSearch::update_multipliers() {
  merit_.update_multipliers(values_);
  return ++updates_ <= kUpdates;
}

bool DesignSearch::end(DesignStatus status, std::string message) {
  report_.status = status;
  report_.message = std::move(message);
  return false;
}

/// Further remarks on the design that was kept.
void DesignSearch::report_remarks() {
  if (report_.status != DesignStatus::kCancelled && !merit_.rank(values_).holds()) {
    report_.message +=
        fmt::format("; the flat linkage's height is {:.2e} of its size (limit {:.2e})",
                    report_.flat_height, options_.flat_height);
    if (options_.smallest_angle > -std::numbers::pi) {
      report_.message +=
          fmt::format(", its smallest angle {:.2f} degrees (limit {:.2f})",
                      values_.smallest_angle / kDegree, options_.smallest_angle / kDegree);
    }
    if (design_.criteria().least_area > 0) {
      report_.message +=
          fmt::format(", the deployed linkage covers {:.4g} (at least {:.4g} is required)",
                      values_.deployed_area, design_.criteria().least_area);
    }
  }
  if (report_.branches_left > 0) {
    report_.message += fmt::format(
        "; the branch of the deployed shape ended {} times along the path, and the search "
        "continued "
        "on the next one",
        report_.branches_left);
  }
}

}  // namespace limber::rods::detail
