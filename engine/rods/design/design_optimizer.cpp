#include "engine/rods/design/design_optimizer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "engine/base/error.h"
#include "engine/rods/design/design_merit.h"
#include "engine/rods/design/trust_region_step.h"

namespace limber::rods {
namespace {

void demand(bool holds, const char* field, const char* rule, double value) {
  if (holds) return;
  throw Error(ErrorCode::kInvalidArgument, field, fmt::format("must be {}, is {:g}", rule, value));
}

// Of the trust region: a step that gains this share of what the model promised is taken; below and
// above these the region shrinks and grows.
constexpr double kTaken = 1e-4;
constexpr double kPoor = 0.25;
constexpr double kGood = 0.75;
constexpr double kShrink = 0.25;
constexpr double kGrow = 2;
constexpr double kLeastRadius = 1e-9;  // of the mean length
constexpr double kInner = 1e-2;        // gradient at which multipliers are updated
constexpr int kIdle = 10;
constexpr int kAstray =
    3;  // trials not believed more than believed, after which none is remembered
constexpr int kUpdates = 30;  // of multipliers
// Of the guard against buckling.
// A flat shape that is lost below this share of the radius that was good last raises the guard; the
// radius where it is lowered begins at a share of the first.
constexpr double kLostRadius = 0.03;
constexpr double kLoweredRadius = 0.03;
// It is lowered after so many steps, or where the gradient has come to a share of that at its last
// change, if it hinders.
constexpr int kHeld = 8;
constexpr double kSettledGuard = 0.1;
constexpr double kNoEnergy = 1e-12;  // share of the scale of energies that is rounding
// Where branches end: how often another one is looked for from a point, and from all.
constexpr int kFallsAtOnce = 3;
constexpr int kFalls = 20;

/// @param side  1: the start may not lie above the bound, -1: below
Eigen::VectorXd bounds(const char* field, const Eigen::VectorXd& given, double share,
                       const Eigen::VectorXd& start, int side) {
  if (given.size() == 0) return share * start;
  if (given.size() != start.size()) {
    throw Error(
        ErrorCode::kInvalidArgument, field,
        fmt::format("must be one for each of {} variables, are {}", start.size(), given.size()));
  }
  for (Eigen::Index s = 0; s < start.size(); ++s) {
    if (given[s] > 0 && std::isfinite(given[s]) && side * (given[s] - start[s]) >= 0) continue;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}[{}]", field, s),
                fmt::format("is {:g}, which excludes the start's {:g}", given[s], start[s]));
  }
  return given;
}

Eigen::VectorXd stacked(const Eigen::VectorXd& lengths, const Eigen::VectorXd& sections) {
  Eigen::VectorXd all(lengths.size() + sections.size());
  all << lengths, sections;
  return all;
}

/// Least and largest parameters.
struct Bounds {
  Bounds(const LinkageDesign& design, const DesignOptimizerOptions& options) {
    const Eigen::VectorXd lengths = design.parameters().head(design.variables().lengths());
    const Eigen::VectorXd sections = design.parameters().tail(design.variables().sections());
    low = stacked(
        bounds("shortest_lengths", options.shortest_lengths, options.shortest, lengths, -1),
        bounds("thinnest_sections", options.thinnest_sections, options.thinnest, sections, -1));
    high = stacked(
        bounds("longest_lengths", options.longest_lengths, options.longest, lengths, 1),
        bounds("thickest_sections", options.thickest_sections, options.thickest, sections, 1));
  }
  Eigen::VectorXd low, high;
};

double mean_length(const LinkageDesign& design) {
  const int lengths = design.variables().lengths();
  return lengths > 0 ? design.parameters().head(lengths).mean() : design.point().lengths.mean();
}

/// What makes parameters of one unit, that of lengths.
Eigen::VectorXd units(const LinkageDesign& design) {
  Eigen::VectorXd result = Eigen::VectorXd::Ones(design.parameters().size());
  result.tail(design.variables().sections()).setConstant(mean_length(design));
  return result;
}

/// Steps and gradients are by parameters times their units.
class Search {
 public:
  Search(LinkageDesign& design, const DesignOptimizerOptions& options)
      : design_(design),
        options_(options),
        merit_(design, options),
        bounds_(design, options),
        low_(bounds_.low),
        high_(bounds_.high),
        units_(units(design)),
        mean_length_(mean_length(design)),
        first_radius_(options.first_radius * mean_length_ *
                      std::sqrt(static_cast<double>(low_.size()))),
        radius_(first_radius_),
        good_radius_(first_radius_) {}

  DesignReport run(const JobContext& context, const DesignCallback& on_step) {
    values_ = design_.values(design_.point());
    report_.before = values_;
    first_gradient_ = projected(merit_.gradient(values_)).norm();
    if (options_.guard == BucklingGuard::kFromStart) {
      merit_.guard().raise_at_once(values_.objective, flat_energy());
      ++report_.guard_raised;
    }
    while (step(context, on_step)) {
    }
    return_to_best();
    report_.after = values_;
    report_.flat_height = merit_.flat_height(values_);
    const Eigen::VectorXd& parameters = design_.parameters();
    for (Eigen::Index s = 0; s < parameters.size(); ++s)
      if (parameters[s] <= low_[s] || parameters[s] >= high_[s])
        report_.at_bound.push_back(static_cast<int>(s));
    return report_;
  }

 private:
  [[nodiscard]] Eigen::VectorXd product(const Eigen::VectorXd& v) {
    ++report_.products;
    return merit_.product(values_, v.cwiseQuotient(units_)).cwiseQuotient(units_);
  }

  /// What the guard is measured by. Rounding is no measure: instead of it what energies are.
  [[nodiscard]] double flat_energy() const {
    const double scale = design_.criteria().energy_scale;
    return values_.flat_energy > kNoEnergy * scale ? values_.flat_energy : scale;
  }

  /// Where bounds let a descent go.
  [[nodiscard]] Eigen::VectorXd projected(Eigen::VectorXd gradient) const {
    gradient = gradient.cwiseQuotient(units_);
    const Eigen::VectorXd& parameters = design_.parameters();
    for (Eigen::Index s = 0; s < gradient.size(); ++s) {
      if ((parameters[s] <= low_[s] && gradient[s] > 0) ||
          (parameters[s] >= high_[s] && gradient[s] < 0))
        gradient[s] = 0;
    }
    return gradient;
  }

  /// What is soft may also be what buckles: after that, steps are measured by lengths for a while.
  [[nodiscard]] detail::ModelStep newton_step(const Eigen::VectorXd& slope) {
    detail::CurvatureMemory unused;
    const double enough = std::min(0.1, std::sqrt(slope.norm() / first_gradient_)) * slope.norm();
    return detail::trust_region_step(
        slope, {radius_in_memory(), enough, options_.max_products},
        [this](const Eigen::VectorXd& v) { return product(v); }, paused_ > 0 ? unused : memory_);
  }

  /// The radius is a length: as the last step's, by which both measures are compared.
  [[nodiscard]] double radius_in_memory() const {
    if (memory_.empty() || last_step_.size() == 0) return radius_;
    return radius_ * memory_.size(last_step_) / last_step_.norm();
  }

  /// @returns whether there is a next one
  bool step(const JobContext& context, const DesignCallback& on_step) {
    if (context.cancellation.requested()) return end(DesignStatus::kCancelled, "cancelled");
    if (report_.iterations == options_.max_iterations) {
      std::string message = fmt::format("{} steps", report_.iterations);
      if (merit_.violation(values_) > detail::kHolds) message += "; " + told_violation();
      return end(DesignStatus::kIterationLimit, std::move(message));
    }
    if (hopeless())
      return end(DesignStatus::kInfeasible, told_violation() + ", and nothing brings it nearer");
    const Eigen::VectorXd slope = projected(merit_.gradient(values_));
    const double size = first_gradient_ > 0 ? slope.norm() / first_gradient_ : 0;
    if (size <= options_.tolerance ||
        (size <= kInner && merit_.violation(values_) > detail::kHolds)) {
      if (lower_guard()) return true;
      if (merit_.violation(values_) <= detail::kHolds)
        return end(DesignStatus::kConverged, "the gradient is small");
      if (!update_multipliers()) return end(DesignStatus::kInfeasible, told_violation());
      return true;
    }
    auto [p, bent, at_rim, complete] = newton_step(slope);
    const double promise = -(slope.dot(p) + 0.5 * p.dot(bent));
    if (complete && promise <= options_.least_gain * std::abs(merit_.value(values_)) &&
        merit_.violation(values_) <= detail::kHolds) {
      if (lower_guard()) return true;
      return end(DesignStatus::kConverged, "no step near by would gain anything worth it");
    }
    ++report_.iterations;
    const Eigen::VectorXd& here = design_.parameters();
    const Eigen::VectorXd wanted = here + p.cwiseQuotient(units_);
    const Eigen::VectorXd tried = wanted.cwiseMax(low_).cwiseMin(high_);
    if (tried != wanted) {
      p = (tried - here).cwiseProduct(units_);
      bent = product(p);
    }
    const double promised = -(slope.dot(p) + 0.5 * p.dot(bent));
    DesignTrial trial = design_.trial(tried, context);
    report_.newton_steps += trial.iterations;
    if (trial.status == TrialStatus::kCancelled) return end(DesignStatus::kCancelled, "cancelled");
    bool taken = judge(trial, p.norm(), promised, at_rim);
    if (trial.lost == LostShape::kDeployed && radius_ < kLostRadius * good_radius_)
      taken = leave_branch(tried, trial, context);
    last_step_ = std::move(p);
    if (on_step) {
      on_step({report_.iterations, values_, merit_.flat_height(values_), radius_, size, taken,
               trial.status == TrialStatus::kFound ? std::string() : trial.message, report_.refused,
               report_.not_believed, report_.flat_lost, merit_.guard().weight()},
              design_);
      const double before = values_.objective;
      values_ = design_.values(design_.point());
      if (values_.objective != before) memory_.forget();  // the criteria are others
    }
    if (context.progress)
      context.progress("designing", report_.iterations / double(options_.max_iterations));
    if (radius_ < kLeastRadius * mean_length_) {
      if (trial.status == TrialStatus::kFound)
        return idle(DesignStatus::kSettled, "no smaller step gains anything");
      return idle(DesignStatus::kStuck, trial.message);
    }
    if (idle_ < kIdle) return true;
    return idle(DesignStatus::kSettled, "ten steps gained next to nothing");
  }

  /// Nothing moves any more: at an end only if the constraints hold.
  bool idle(DesignStatus status, const std::string& message) {
    if (status == DesignStatus::kSettled && lower_guard()) return true;
    if (merit_.violation(values_) <= detail::kHolds || status == DesignStatus::kStuck)
      return end(status, message);
    if (!update_multipliers()) return end(DesignStatus::kInfeasible, told_violation());
    idle_ = 0;
    radius_ = std::max(radius_, 1e-3 * mean_length_);
    return true;
  }

  bool judge(DesignTrial& trial, double length, double promised, bool at_rim) {
    if (trial.status != TrialStatus::kFound) {
      ++report_.not_believed;
      radius_ = kShrink * length;
      if (++astray_ >= kAstray) {
        memory_.forget();
        paused_ = pause_;
        pause_ *= 2;
        astray_ = 0;
      }
      if (trial.lost == LostShape::kFlat) ++report_.flat_lost;
      if (trial.lost == LostShape::kFlat && radius_ < kLostRadius * good_radius_ &&
          options_.guard != BucklingGuard::kNever)
        raise_guard();
      return false;
    }
    astray_ = std::max(0, astray_ - 1);
    paused_ = std::max(0, paused_ - 1);
    const DesignValues values = design_.values(trial.point);
    const double gained = merit_.value(values_) - merit_.value(values);
    const double ratio = promised > 0 ? gained / promised : -1;
    if (ratio < kPoor) radius_ = kShrink * length;
    if (ratio > kGood && at_rim) radius_ = kGrow * std::max(length, radius_);
    if (!(ratio > kTaken)) {
      ++report_.refused;
      return false;
    }
    idle_ = gained < options_.least_gain * std::abs(merit_.value(values_)) ? idle_ + 1 : 0;
    accept(std::move(trial.point), values);
    good_radius_ = std::max(good_radius_, radius_);
    if (merit_.guard().weight() > 0) {
      const double now = projected(merit_.gradient(values_)).norm();
      if (held_ == 0) guarded_gradient_ = now;
      const bool waited = ++held_ >= kHeld || now < kSettledGuard * guarded_gradient_;
      if (waited && merit_.guard().hinders(values_.objective, flat_energy())) (void)lower_guard();
    }
    return true;
  }

  void accept(DesignPoint point, const DesignValues& values) {
    ++report_.accepted;
    falls_here_ = 0;
    values_ = values;
    design_.move_to(std::move(point));
    if (best_) remember();
  }

  /// Goes on from the branch that the deployed shape falls to where its own ends, if that is worth
  /// more. @returns whether it does; `trial` is the one that led there then
  bool leave_branch(const Eigen::VectorXd& parameters, DesignTrial& trial,
                    const JobContext& context) {
    if (falls_here_ == kFallsAtOnce || falls_ == kFalls) return false;
    ++falls_here_;
    ++falls_;
    DesignTrial fallen = design_.trial(parameters, context, Landing::kDeployedAnywhere);
    report_.newton_steps += fallen.iterations;
    if (fallen.status != TrialStatus::kFound) return false;
    const DesignValues values = design_.values(fallen.point);
    if (!(merit_.value(values) < merit_.value(values_))) return false;
    ++report_.branches_left;
    accept(fallen.point, values);
    memory_.forget();
    idle_ = astray_ = 0;
    good_radius_ = radius_ = std::max(radius_, kLoweredRadius * first_radius_);
    trial = std::move(fallen);
    return true;
  }

  void raise_guard() {
    held_ = 0;
    remember();
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
  bool lower_guard() {
    if (merit_.guard().weight() == 0) return false;
    merit_.guard().lower();
    safe_ = design_.point();
    held_ = idle_ = 0;
    good_radius_ = radius_ = std::max(radius_, kLoweredRadius * first_radius_);
    return true;
  }

  /// The guard's own weight may take the objective uphill for a while.
  void remember() {
    const double violated = merit_.violation(values_);
    if (best_ && (values_.objective >= best_objective_ ||
                  violated > std::max(best_violation_, detail::kHolds)))
      return;
    best_ = design_.point();
    best_objective_ = values_.objective;
    best_violation_ = violated;
  }
  void return_to_best() {
    if (!best_) return;
    const DesignValues best = design_.values(*best_);  // the criteria may be others
    const double allowed = std::max(merit_.violation(values_), detail::kHolds);
    if (best.objective >= values_.objective || merit_.violation(best) > allowed) return;
    design_.move_to(*best_);
    values_ = best;
  }

  /// Is a constraint violated, and no less so for long, whatever it weighs?
  [[nodiscard]] bool hopeless() {
    using Verdict = detail::ViolationWatch::Verdict;
    const Verdict verdict = watch_.see(merit_.violation(values_), report_.iterations);
    return verdict == Verdict::kHopeless || (verdict == Verdict::kRaise && !update_multipliers());
  }

  /// @returns false where that has been of no use for long
  bool update_multipliers() {
    merit_.update_multipliers(values_);
    return ++updates_ <= kUpdates;
  }

  [[nodiscard]] std::string told_violation() const {
    constexpr double kDegree = std::numbers::pi / 180;
    std::string told = fmt::format("the flat linkage's height is {:.2e} of its size (asked {:.2e})",
                                   merit_.flat_height(values_), options_.flat_height);
    if (options_.smallest_angle > -std::numbers::pi) {
      told += fmt::format(", its smallest angle {:.2f} degrees (asked {:.2f})",
                          values_.smallest_angle / kDegree, options_.smallest_angle / kDegree);
    }
    return told;
  }

  bool end(DesignStatus status, std::string message) {
    report_.status = status;
    report_.message = std::move(message);
    if (report_.branches_left > 0) {
      report_.message += fmt::format(
          "; the deployed shape's branch ended {} times on the way, and "
          "the search went on from the next one",
          report_.branches_left);
    }
    return false;
  }

  LinkageDesign& design_;
  const DesignOptimizerOptions& options_;
  detail::DesignMerit merit_;
  const Bounds bounds_;
  const Eigen::VectorXd &low_, &high_;
  const Eigen::VectorXd units_;
  const double mean_length_, first_radius_;
  double radius_;
  double good_radius_;  // the largest since the guard was moved
  double first_gradient_ = 0;
  DesignValues values_;
  detail::CurvatureMemory memory_;
  Eigen::VectorXd last_step_;  // taken or not
  int updates_ = 0, idle_ = 0;
  detail::ViolationWatch watch_;
  int astray_ = 0;                  // trials not believed more than those believed
  int paused_ = 0, pause_ = 8;      // steps without a memory, and how many next time
  int falls_ = 0, falls_here_ = 0;  // tried, of them since the last step that was taken
  int held_ = 0;                    // steps taken since the guard was moved
  double guarded_gradient_ = 0;     // at the first of them
  std::optional<DesignPoint> best_;
  std::optional<DesignPoint> safe_;  // where the guard was lowered last
  double best_objective_ = 0, best_violation_ = 0;
  DesignReport report_;
};

}  // namespace

void DesignOptimizerOptions::validate() const {
  demand(max_iterations > 0, "max_iterations", "> 0", max_iterations);
  demand(max_products > 0, "max_products", "> 0", max_products);
  demand(shortest > 0 && shortest < 1, "shortest", "in (0, 1)", shortest);
  demand(longest > 1 && std::isfinite(longest), "longest", "> 1 and finite", longest);
  demand(thinnest > 0 && thinnest < 1, "thinnest", "in (0, 1)", thinnest);
  demand(thickest > 1 && std::isfinite(thickest), "thickest", "> 1 and finite", thickest);
  demand(flat_height > 0, "flat_height", "> 0", flat_height);
  demand(smallest_angle < std::numbers::pi, "smallest_angle", "< pi", smallest_angle);
  demand(first_radius > 0 && first_radius < 1, "first_radius", "in (0, 1)", first_radius);
  demand(tolerance > 0 && tolerance < 1, "tolerance", "in (0, 1)", tolerance);
  demand(least_gain > 0, "least_gain", "> 0", least_gain);
}

DesignReport optimize_design(LinkageDesign& design, const DesignOptimizerOptions& options,
                             const JobContext& context, const DesignCallback& on_step) {
  options.validate();
  return Search(design, options).run(context, on_step);
}

}  // namespace limber::rods
