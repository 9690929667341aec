#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/rods/design/compare_designs.h"
#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/linkage_design.h"
#include "engine/rods/design/placed_surface.h"
#include "engine/scene/linkage.h"
#include "engine/session/core/values.h"
#include "engine/session/linkages/rod_sizes.h"

namespace limber::session {

/// The goal of a design of a session's linkage; see rods::DesignCriteria for the objective. Lengths
/// and positions in the scene's unit.
struct DesignGoal {
  double flat_share = 0.9;       // gamma, in [0, 1]
  double distance_weight = 1e5;  // beta, >= 0
  double surface_weight = 1;     // w_surf, >= 0
  std::vector<rods::JointTarget> targets;
  std::shared_ptr<const rods::TargetSurface> surface = {};  // null: none
  rods::SurfacePlacement placement = {};                    // of the surface
  /// Weights of each joint's distance to the surface, times surface_weight, >= 0; empty: all 1.
  Eigen::VectorXd joint_surface_weights = {};

  /// The surface where it is to be; null: none.
  [[nodiscard]] std::shared_ptr<const rods::TargetSurface> placed_surface() const;

  /// @param joints  of the linkage
  /// @throws Error naming the member: {kInvalidArgument} for weights outside [0, 1e30], positions
  /// that are not finite, a joint twice, nothing to go to; {kOutOfRange} targets[i].joint
  void validate(int joints) const;
};

/// Sizes of rods that a design begins with.
struct DesignStart {
  Eigen::VectorXd segments, edges;  // rest lengths
  Eigen::VectorXd sections;         // scales
  bool by_edges = false;            // edges have lengths of their own
};

struct DesignRequest {
  DesignGoal goal;
  /// Rest lengths stay between these shares of those of the start; 0 < shortest < 1 < longest.
  double shortest = 0.5;
  double longest = 2;
  /// Allowed root mean square height of the flat linkage's joints over their plane, as a share of
  /// its extent, > 0; nothing: 1.2 times the height at the start, plus a thousandth.
  std::optional<double> flat_height = {};
  /// Bound on the smallest opening angle of the flat linkage [rad], in (-pi, pi). Nothing: a tenth
  /// of the angle at the start if that is open by more than 0.02, else none.
  std::optional<double> smallest_angle = {};
  int max_iterations = 200;
  /// Bounds of each rest length that is varied [length], of segments or of edges, in place of the
  /// shares; empty: the shares. The start must lie between them.
  Eigen::VectorXd shortest_lengths = {}, longest_lengths = {};
  /// Rest lengths of segments, or of edges, and scales of sections or not.
  rods::DesignVariables variables = {};
  /// Scales of sections that are varied stay between these shares of those of the start; 0 <
  /// thinnest < 1 < thickest.
  double thinnest = 0.5;
  double thickest = 2;
  /// Bounds of each segment's scale in place of the shares, as for lengths.
  Eigen::VectorXd thinnest_sections = {}, thickest_sections = {};
  rods::BucklingGuard guard = rods::BucklingGuard::kWhenNeeded;
  /// Points of the placed surface, 3 x joints, as rods::StartingGrid has them: the surface is put
  /// where these are nearest to the joints of the deployed linkage. Empty: it stays where it is.
  Eigen::Matrix3Xd fitted_points = Eigen::Matrix3Xd(3, 0);
  /// Mean opening angle at which the flat shape is held [rad], in (-pi, pi). Nothing: it is not
  /// held, except for linkages that deploy without stress, which keep their angle.
  std::optional<double> flat_angle = {};
  /// The deployed linkage's cells have at least this share of the area that they have at the start,
  /// or of the surface's where that is less, in [0, 1]. Means nothing without a surface.
  double least_cover = 0.9;

  /// @param start  with its sizes, which it begins with
  /// @throws Error as DesignGoal::validate with field goal...., {kInvalidArgument} naming members,
  /// {kFailedPrecondition} with field variables if lengths of segments are varied in a linkage
  /// whose edges have lengths of their own
  void validate(int joints, const DesignStart& start) const;
};

/// Changes to a running design; absent members stay.
struct DesignChange {
  std::optional<double> flat_share, distance_weight, surface_weight;
  std::optional<std::vector<rods::JointTarget>> targets;              // all of them
  std::optional<std::shared_ptr<const rods::TargetSurface>> surface;  // null: none any more
  std::optional<rods::SurfacePlacement> placement;
  std::optional<Eigen::VectorXd> joint_surface_weights = {};  // empty: all 1

  void apply_to(DesignGoal& goal) const;
};

/// Terms of the objective for one pair of equilibria.
struct DesignTerms {
  double objective = 0;        // J
  double flat_energy = 0;      // [N length unit]
  double deployed_energy = 0;  // [N length unit]
  double target_rms = 0;       // of joints that have targets, to these [length unit]
  double surface_rms = 0;      // of all joints to the surface [length unit]
  double flat_height = 0;      // share of the extent
  double smallest_angle = 0;   // of the flat linkage [rad]
  bool holds = false;          // all constraints
  /// Area of the surface that the deployed linkage's cells cover [length unit^2]: theirs
  /// (rods::CellArea), up to all of the surface's. 0 without a surface.
  double covered_area = 0;
  double cover = 0;  // as a share of the start's; 0 without a surface, or cells
};

enum class DesignState { kStarting, kRunning, kPaused, kEnded };

/// How a design ended: as the search did, or by somebody.
enum class DesignEnd {
  kNone,
  kConverged,
  kSettled,
  kInfeasible,
  kStuck,
  kIterationLimit,
  kStopped,  // by a client
  kFailed,   // it could not begin, or not continue
};

/// Outcomes of a design's trials so far.
struct DesignTrials {
  int refused = 0;       // they gained too little
  int not_believed = 0;  // an equilibrium was lost, or lay on another branch
  int flat_lost = 0;     // of these: the flat one, which buckles
  bool guarded = false;  // is the guard against buckling up
  std::string refusal;   // why the last one was not believed; empty: it was
};

/// An earlier design of the session, for the same goal and from the same pins and angles, that
/// ended elsewhere: its figures for the goal.
struct OtherOptimum {
  std::uint64_t tag = 0;
  DesignTerms terms;  // by the scales of the newer design, so that objectives compare
  rods::DesignDifference difference;
};

/// The state of a design: immutable, shared between threads.
struct DesignInfo {
  std::uint64_t tag = 0;  // a number that the client chose
  DesignState state = DesignState::kStarting;
  DesignEnd end = DesignEnd::kNone;
  int iteration = 0;
  int max_iterations = 0;
  bool accepted = false;  // was the trial of this iteration taken
  DesignGoal goal;
  double flat_height_allowed = 0;
  std::optional<double> smallest_angle_allowed;
  DesignTerms start, now;
  /// The best terms: of least objective among those that keep all constraints; if none does, those
  /// with the smallest violation. Counted anew when the goal changes.
  DesignTerms best;
  int best_iteration = 0;
  std::vector<int> at_bound;      // rest lengths that are varied; of a design that ended by itself
  std::optional<Revision> taken;  // the revision that brought its best lengths
  std::string message, fault_field;  // why it ended
  rods::DesignVariables variables;
  std::vector<int> sections_at_bound;  // segments, as at_bound
  rods::BucklingGuard guard = rods::BucklingGuard::kWhenNeeded;
  DesignTrials trials;
  std::vector<OtherOptimum> other_optima;  // of a design that has ended by itself
  ErrorCode fault = ErrorCode::kInternal;  // of a failed design, with message and fault_field
  std::optional<double> flat_angle = {};   // that the flat shape is held at [rad]
  double least_cover = 0;                  // that is required, see DesignRequest
  /// The erection of the best design, after the design has ended; if none was found, it gives the
  /// reason. Null: none was looked for.
  std::shared_ptr<const scene::LinkageErection> erection = {};
};

/// Marks that no way to open is known.
[[nodiscard]] std::shared_ptr<const scene::LinkageErection> without_erection(
    const std::string& reason);
/// The erection that is stored with a design, or the mark that none was searched for.
[[nodiscard]] std::shared_ptr<const scene::LinkageErection> erection_of(const DesignInfo& info);

/// Sizes of rods that can be taken, and the equilibrium that was found with them.
struct DesignCandidate {
  RodSizes sizes;
  rods::DesignVariables variables;  // that were varied: what else the session has stays
  rods::LinkageState flat, deployed;
};

/// At one moment: the report on the newest design, null before the first, and what would be taken
/// of it, null where there is nothing.
struct NewestDesign {
  std::shared_ptr<const DesignInfo> info;
  std::shared_ptr<const DesignCandidate> best;
};

}  // namespace limber::session
