#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::rods {

/// Cases in which a search weighs the flat energy more than its objective does. Rest lengths then
/// keep fitting a flat drawing, and the flat linkage does not buckle during the search. The weight
/// goes back to nothing before the search ends by itself.
enum class BucklingGuard {
  kWhenNeeded,  // where trials buckle again and again
  kFromStart,   // from the first step: for starts that are about to buckle, as closed linkages
  kNever,       // trials whose flat shape is lost are refused, and that is all
};

struct DesignOptimizerOptions {
  int max_iterations = 200;  // steps that were taken or refused, > 0
  int max_products = 60;     // second derivatives times a direction in one step, > 0
  /// Rest lengths stay between these shares of those of the start; 0 < shortest < 1 < longest.
  double shortest = 0.5;
  double longest = 2;
  /// Root mean square height of the flat linkage's joints over its plane, as a share of the length
  /// scale, > 0: the requested flatness.
  double flat_height = 1e-3;
  /// Bound on the smallest opening angle of the flat linkage [rad]; < -pi: none.
  double smallest_angle = -4;
  /// Largest change of a rest length in the first step, as a share of the mean one, > 0; of a
  /// section's scale, as a share of 1.
  double first_radius = 0.01;
  /// Projected gradient over that of the objective at the start at which the search ends, in (0,
  /// 1).
  double tolerance = 1e-5;
  /// Least gain of the objective, as a share of it, > 0. The search ends after ten steps in a row
  /// below it, or at a step of Newton's that would not gain as much.
  double least_gain = 1e-5;
  BucklingGuard guard = BucklingGuard::kWhenNeeded;
  /// Bounds of each rest length that is varied [length], of segments or of edges, in place of the
  /// shares; empty: the shares. The start must lie between them.
  Eigen::VectorXd shortest_lengths, longest_lengths;
  /// Scales of sections that are varied stay between these shares of those of the start; 0 <
  /// thinnest < 1 < thickest. Thin rods cost less energy: without targets all go to the thinnest.
  double thinnest = 0.5;
  double thickest = 2;
  /// Bounds of each segment's section scale in place of the shares, as for lengths.
  Eigen::VectorXd thinnest_sections = {}, thickest_sections = {};

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

enum class DesignStatus {
  kConverged,       // the projected gradient, or the gain of a Newton step, is small, and all
                    // constraints hold
  kSettled,         // nothing is gained any more, all constraints hold
  kInfeasible,      // nothing is gained any more, and a constraint does not hold
  kStuck,           // no trial near the design was believed: an equilibrium ends here
  kIterationLimit,  // out of steps
  kCancelled,       // by the caller
};

struct DesignProgress {
  int iteration = 0;
  DesignValues values;
  double flat_height = 0;    // share of the length scale, as the option
  double radius = 0;         // of the trust region [length]
  double gradient = 0;       // projected, over that of the objective at the start
  bool accepted = false;     // or was the trial refused
  std::string refusal = {};  // why its equilibria were not believed; empty: they were
  int refused = 0, not_believed = 0, flat_lost = 0;  // so far, as DesignReport has them
  double guard = 0;  // weight of the flat energy that the guard adds, over the objective's scale
};

struct DesignReport {
  DesignStatus status = DesignStatus::kIterationLimit;
  int iterations = 0;
  int accepted = 0;
  int refused = 0;       // trials that gained too little
  int not_believed = 0;  // trials whose equilibria were lost or had jumped
  int products = 0;
  DesignValues before, after;
  double flat_height = 0;  // share of the length scale
  /// Parameters of the design that are at a bound: segments by default.
  std::vector<int> at_bound;
  std::string message;
  int newton_steps = 0;  // of both equilibria, over all trials
  int flat_lost = 0;     // of the trials not believed: those whose flat shape buckled or was lost
  int guard_raised = 0;  // how often the guard against buckling went up
  /// How often the deployed shape's branch ended and the search went on from another one.
  int branches_left = 0;
};

/// Called after every step with the design as it stands. May change its criteria (set_criteria):
/// the search continues with the new ones.
using DesignCallback = std::function<void(const DesignProgress& progress, LinkageDesign& design)>;

/// Called where the search would end, with its report and the design at its best. It may move the
/// design and change its criteria: the search then continues from there, as long as it has steps
/// left, and calls again at its next end.
using DesignEndCallback = std::function<void(const DesignReport& report, LinkageDesign& design)>;

/// Variables of a design of least objective, flat enough, with no angle below its bound, and with
/// cells of DesignCriteria::least_area.
///
/// Newton's method with conjugate gradients in a trust region (Steihaug 1983) on the variables that
/// are not at their bounds. Scales of sections are in units of a mean rest length. Curvature
/// learned in earlier steps preconditions it (CurvatureMemory); an augmented Lagrangian keeps the
/// constraints (Rockafellar 1973). A trial that lands on another branch, or nowhere, shrinks the
/// region. If the flat shape causes this and little is left of the region, a guard against buckling
/// goes up. If the deployed shape causes it, its branch then ends: the search continues from the
/// shape it falls to if the merit found there, not predicted, is less. The design stands at the
/// best point that was accepted, also where the search stops early.
/// @throws Error as DesignOptimizerOptions::validate; {kInvalidArgument} with field
/// shortest_lengths, longest_lengths, thinnest_sections or thickest_sections, and [i] where the
/// start lies beyond a bound
DesignReport optimize_design(LinkageDesign& design, const DesignOptimizerOptions& options = {},
                             const JobContext& context = {}, const DesignCallback& on_step = {},
                             const DesignEndCallback& on_end = {});

}  // namespace limber::rods
