#pragma once

#include <algorithm>
#include <cmath>

// Searches along a direction d from a point x: f(t) = value at x + t d, or along a curve that
// begins there. They do not allocate; trial points belong to the caller.

namespace limber {

/// Dimensionless share of the decrease that the slope promises. Not tuned: the usual value (Nocedal
/// and Wright, Numerical Optimization, sec. 3.1), small enough to accept nearly every decrease.
inline constexpr double kArmijoShare = 1e-4;

/// Armijo's rule: a step t is accepted where f(t) <= f(0) + kArmijoShare t f'(0) + rounding.
struct SufficientDecrease {
  double value;         // f(0)
  double slope;         // f'(0); an ascent direction counts as flat: f must not rise
  double rounding = 0;  // of f, >= 0: increases up to it are accepted

  [[nodiscard]] double bound(double step) const {
    return value + kArmijoShare * step * std::min(slope, 0.0) + rounding;
  }
  /// False where f is NaN.
  [[nodiscard]] bool accepts(double step, double at_step) const { return at_step <= bound(step); }

  /// The next step after one that was not accepted: the minimum of the parabola through f(0), f'(0)
  /// and f(step), between 0.1 and 0.5 of the step. 0.25 of it if f is not finite.
  [[nodiscard]] double shorter(double step, double at_step) const {
    if (!std::isfinite(at_step)) return 0.25 * step;
    const double minimum = step * step * -slope / (2 * (at_step - value + step * -slope));
    return std::clamp(minimum, 0.1 * step, 0.5 * step);
  }
};

/// What follows a trial step.
struct StepVerdict {
  bool is_accepted = false;
  double next = 0;  // step to try next

  [[nodiscard]] static StepVerdict accept() { return {true, 0}; }
  [[nodiscard]] static StepVerdict retry(double step) { return {false, step}; }
};

struct BacktrackOptions {
  double first_step = 1;
  double shortest_step = 0;  // only longer steps are tried, >= 0
  int max_trials = 100;      // > 0

  /// @throws Error{kInvalidArgument}
  void validate() const;
};

struct BacktrackReport {
  bool is_accepted = false;
  double step = 0;  // accepted, else 0
  int trials = 0;
};

/// Tries steps until one is accepted, is too short or is NaN. StepVerdict attempt(step) accepts the
/// step or asks for another: a shorter one, or the same by other means.
template <class Attempt>
[[nodiscard]] BacktrackReport backtrack(const BacktrackOptions& options, Attempt&& attempt) {
  options.validate();
  BacktrackReport report;
  double step = options.first_step;
  while (step > options.shortest_step && report.trials < options.max_trials) {
    ++report.trials;
    const StepVerdict verdict = attempt(step);
    if (verdict.is_accepted) return {true, step, report.trials};
    step = verdict.next;
  }
  return report;
}

struct Descent : BacktrackReport {
  double value = 0;  // f at the step that was accepted, or at the last one tried
};

/// Halves the step until `rule` accepts f = value_at(step).
template <class ValueAt>
[[nodiscard]] Descent backtrack(const SufficientDecrease& rule, const BacktrackOptions& options,
                                ValueAt&& value_at) {
  Descent descent;
  static_cast<BacktrackReport&>(descent) = backtrack(options, [&](double step) {
    descent.value = value_at(step);
    return rule.accepts(step, descent.value) ? StepVerdict::accept() : StepVerdict::retry(step / 2);
  });
  return descent;
}

struct ExpandOptions {
  double first_step = 1e-4;  // > 0
  double longest_step = 1;   // finite
  double rounding = 0;       // of changes of f, >= 0

  /// @throws Error{kInvalidArgument}
  void validate() const;
};

/// Doubles the step while f falls: to the first valley, as the next one may belong to the other
/// side of a ridge. Changes within rounding are passed over until f has fallen once.
/// @param change_at  f(step) - f(0); NaN: the step is not possible, which ends the search
/// @param keep       called after change_at where that is the lowest so far
/// @returns the change at the last step kept, < 0; 0: none
template <class ChangeAt, class Keep>
[[nodiscard]] double expand(const ExpandOptions& options, ChangeAt&& change_at, Keep&& keep) {
  options.validate();
  double lowest = 0;
  for (double step = options.first_step; step <= options.longest_step; step *= 2) {
    const double change = change_at(step);
    if (lowest == 0 && std::abs(change) <= options.rounding) continue;
    if (!(change < lowest)) break;
    lowest = change;
    keep(step);
  }
  return lowest;
}

}  // namespace limber
