#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/rods/equilibrium/linkage_equilibrium.h"

namespace limber::rods {

struct DeploymentOptions {
  /// Shares of the path, in (0, 1]: the first step, and the range that later ones stay in. Steps
  /// halve where the equilibrium moves unlike its prediction, and grow back where it is easy.
  double first_step = 0.02;
  double largest_step = 0.02;
  double smallest_step = 0.0005;
  /// EquilibriumOptions::tolerance of all steps but the last, in (0, 1).
  double step_tolerance = 1e-4;
  /// A step that ends this far [rad] from its prediction has jumped, > 0.
  double jump_turn = 0.5;
  /// Newton steps that a step may take before a shorter one is tried, > 0.
  int patience = 30;
  EquilibriumOptions last;  // for the end of the path, and for steps that cannot be shortened
  /// Branches that may end, lose their stability or be lost before the path is given up, > 0.
  /// Excessive requests make a linkage jump between branches.
  int most_ends = 20;
  /// Newton steps in which a tenth of the path is passed, or it is given up, > 0. More where steps
  /// are much shorter than by default.
  int most_iterations = 2500;

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

enum class BranchEvent {
  kNone,
  kBranching,   // the branch lost its stability here; the path continues on a stable one beside it
  kLimitPoint,  // the branch ended here: its path ran along its softest direction; this is another
  kJump,        // the branch was lost without having ended; this is another
};

struct DeploymentStep {
  double progress = 0;            // share of the path, 0 .. 1
  double mean_opening_angle = 0;  // [rad]
  double energy = 0;              // elastic
  int iterations = 0;
  /// Unstable directions met during the search for this step.
  int negative_eigenvalues = 0;
  /// Distance of the equilibrium from its prediction [rad].
  double prediction_error = 0;
  BranchEvent event = BranchEvent::kNone;
};

enum class DeploymentStatus { kReached, kStopped, kCancelled };

/// The held joints that resist most, with the loads that would replace their supports.
struct Resistance {
  std::optional<JointLoad> pin;    // the greatest force
  std::optional<JointLoad> angle;  // the greatest opening torque, of angles that are set
};

struct DeploymentReport {
  DeploymentStatus status = DeploymentStatus::kReached;
  int steps = 0;
  int steps_shortened = 0;  // tries given up for a shorter step
  int steps_failed = 0;     // no equilibrium found, however short: the path stops there
  int iterations = 0;       // Newton steps of all tries
  int corrections = 0;
  int factorizations = 0;
  int branchings = 0, limit_points = 0, jumps = 0;  // events of the path
  std::vector<DeploymentStep> path;
  EquilibriumReport end;      // of the last search, also where it failed
  EquilibriumReport reached;  // of the state, if there was a step
  Conditions held;  // those the state is in equilibrium under; `from` if there was no step
  std::string message;
  Resistance resistance;  // of the state, where the path stopped
};

/// The first joint that has turned over on the path from one shape to another: its opening angle is
/// beyond 225 degrees in either direction, farther than it was. Rods cross there; nothing real does
/// that. At a joint of two ends (valence 2) they lie straight at 180 degrees and cross beyond 360.
[[nodiscard]] std::optional<int> overturned(const LinkageModel& model, const LinkageState& from,
                                            const LinkageState& to);

using StepCallback = std::function<void(const DeploymentStep& step, const LinkageState& state)>;

/// Leads a linkage from its present shape to other conditions, one equilibrium after the other.
///
/// Opening angles (single ones and the mean) and pins with a position go from their present values
/// to those of `to`. Springs, loads and weight fade from those of `from` to those of `to`; all else
/// is as in `to`. Conditions that `from` holds and `to` does not are released before, as in a
/// medium that resists (steps with progress 0, along which the potential falls). If that finds no
/// equilibrium, their reactions fade along the path like loads. If the present shape is no
/// equilibrium, the first step brings it to one. The solver follows one branch. Each step starts
/// from an extrapolation of those before, and one that ends elsewhere is tried again with half its
/// length. A branch that ends is left, and the report says so. No joint turns over: the path stops
/// before. Backwards is the same with other conditions.
///
/// @param state  becomes the last equilibrium reached
/// @throws Error as Conditions::validate and DeploymentOptions::validate
DeploymentReport deploy(LinkageEquilibrium& equilibrium, LinkageState& state,
                        const Conditions& from, const Conditions& to,
                        const DeploymentOptions& options = {}, const JobContext& context = {},
                        const StepCallback& on_step = {});

/// The same without springs and loads at the beginning.
DeploymentReport deploy(LinkageEquilibrium& equilibrium, LinkageState& state, const Conditions& to,
                        const DeploymentOptions& options = {}, const JobContext& context = {},
                        const StepCallback& on_step = {});

}  // namespace limber::rods
