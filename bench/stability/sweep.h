#pragma once

#include <functional>
#include <string>
#include <vector>

namespace limber::bench::stability {

/// Claim of an answer about itself.
enum class Claim { kConverged, kNotConverged };

/// An answer, and its distance from the result of a check that shares no code with its solver.
struct Finding {
  Claim claim = Claim::kNotConverged;
  double error = 0;          // unitless; as Sweep::check says
  double allowed = 0;        // > 0: an answer that claims convergence is wrong above it
  bool is_finite = true;     // all numbers of the answer
  std::string message = {};  // the report's own words
};

/// One hard case, with one number that makes it harder.
struct Sweep {
  std::string wing, name;
  std::string parameter;       // meaning of the number, with its unit
  std::string asked;           // the task
  std::string check;           // reference for the answers
  std::vector<double> values;  // from easy to hard, as a rule in decades
  /// Number of values that must be certified: the project's claim. 0: a case that has no right
  /// answer, or whose limit is measured here.
  int required = 0;
  /// Any of the answers is fine as long as none is wrong. @throws Error where it is refused
  std::function<Finding(double)> run;
  double seconds = 0;  // wall limit of a row [s]; 0: the suite's
};

using Sweeps = std::vector<Sweep>;

/// 10^first, 10^(first + step), .. 10^last.
[[nodiscard]] std::vector<double> decades(int first, int last, int step = 1);

// Wings, a file each.
[[nodiscard]] Sweeps modal_sweeps();
[[nodiscard]] Sweeps dynamics_sweeps();
[[nodiscard]] Sweeps reconstruction_sweeps();
[[nodiscard]] Sweeps model_sweeps();
[[nodiscard]] Sweeps exact_sweeps();
[[nodiscard]] Sweeps linear_motion_sweeps();
[[nodiscard]] Sweeps bent_motion_sweeps();
[[nodiscard]] Sweeps recovery_sweeps();
[[nodiscard]] Sweeps rod_sweeps();
[[nodiscard]] Sweeps linkage_sweeps();
[[nodiscard]] Sweeps linkage_angle_sweeps();
[[nodiscard]] Sweeps beam_sweeps();
[[nodiscard]] Sweeps beam_branch_sweeps();
[[nodiscard]] Sweeps edit_sweeps();
/// Rows that are faulty on purpose: wrong, not finite, hanging, crashed. The suite must find each.
[[nodiscard]] Sweeps faulty_sweeps();

/// Whether $LIMBER_STABILITY_FAULTS asks for these, and for no others.
[[nodiscard]] bool wants_faults();

}  // namespace limber::bench::stability
