#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/rods/design/design_variables.h"
#include "engine/rods/design/shape_functions.h"
#include "engine/rods/design/target_surface.h"
#include "engine/rods/equilibrium/linkage_equilibrium.h"

namespace limber::rods {

/// Design criteria of a linkage (rod linkages, sec. 3, with the objective it refers to):
///
///   J = gamma/E_0 E(flat) + (1 - gamma)/E_0 E(deployed)
///       + beta/(2 l_0^2) (sum of w |x - t|^2 + w_surf sum of |x - P(x)|^2)
///
/// over the deployed joints x. Further criteria are c, the squared distances of the flat linkage's
/// joints from their plane, a smooth number below its smallest opening angle, and the area of the
/// deployed linkage's cells.
struct DesignCriteria {
  double flat_share = 0.9;     // gamma, in [0, 1]
  double distance_weight = 1;  // beta, >= 0
  /// E_0 [force length], >= 0; 0: the deployed energy of the start, or, where that is nothing
  /// (mechanisms), the energy that bends the whole linkage by an angle of one
  double energy_scale = 0;
  double length_scale = 0;       // l_0 [length]; 0: the extent of the drawn linkage
  double angle_sharpness = 300;  // of SmallestAngle [1/rad], > 0
  std::optional<Plane> plane;    // where the flat linkage is to lie; empty: in any plane
  std::vector<JointTarget> targets;
  std::shared_ptr<const TargetSurface> surface;  // null: none
  double surface_weight = 1;                     // w_surf, >= 0
  /// Weight of each joint's distance to the surface, >= 0, e.g. 0 for those that may hang over its
  /// rim; empty: all 1.
  Eigen::VectorXd joint_surface_weights;
  /// Least area of the deployed linkage's cells [length^2], >= 0, that a search keeps. Without it a
  /// grid comes near to a surface by covering less of it. A value of 0 allows any.
  double least_area = 0;

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

/// One number for each measure of a design, or a vector of derivatives by p, the design's
/// variables.
template <class Value>
struct DesignMeasures {
  Value objective;       // J
  Value flatness;        // c [length^2]
  Value smallest_angle;  // [rad]
  Value flat_energy;     // [force length]; part of the objective too
  Value deployed_area;   // CellArea [length^2]
};

struct DesignValues : DesignMeasures<double> {
  double deployed_energy = 0;  // [force length]
  double distance = 0;         // half the weighed squared distances [length^2]
};

/// Order of the Taylor polynomial of an equilibrium in the variables, from which a trial begins.
enum class PredictorOrder { kFirst, kSecond };

struct DesignLimits {
  /// A trial whose equilibrium is this far [rad] from where it was predicted has left its branch.
  double largest_surprise = 0.3;
  /// Predictions that move the shape farther than this [rad] are not made: the trial is too far.
  double largest_move = 1;
  EquilibriumOptions equilibrium{.max_iterations = 60, .tolerance = 1e-10};
  PredictorOrder predictor = PredictorOrder::kSecond;
  /// Largest distance of an equilibrium from its prediction, as a multiple of the predicted motion,
  /// > 0. Distances up to `small_surprise` [rad], >= 0, are allowed too. An equilibrium that is
  /// farther has jumped.
  double surprise_share = 1;
  double small_surprise = 0.03;

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

/// Which of a design's equilibria a trial lost first.
enum class LostShape { kNone, kFlat, kDeployed };

enum class TrialStatus {
  kFound,
  kTooFar,     // the prediction moves the shape too far to be trusted
  kLost,       // there is no equilibrium near the prediction
  kJumped,     // there is one, but of another branch
  kCancelled,  // by the caller
};

/// Which equilibria a trial believes.
enum class Landing {
  kPredicted,         // those near their predictions
  kDeployedAnywhere,  // of the deployed shape whichever it falls to: its own may have ended
};

struct DesignTrial {
  TrialStatus status = TrialStatus::kFound;
  DesignPoint point;   // meaningful with kFound
  int iterations = 0;  // Newton steps of both equilibria
  std::string message;
  /// Largest angle between an equilibrium that was found and its prediction [rad].
  double surprise = 0;
  LostShape lost = LostShape::kNone;
};

/// Does a shape store no more than rounding, as deployed mechanisms do?
[[nodiscard]] bool is_without_stress(const LinkageModel& model, const LinkageState& state);

/// A linkage and its two equilibria as functions of p: the rest lengths of its segments, or of its
/// edges, the scales of its sections, or both (DesignVariables). Stays at one design, where
/// derivatives are taken, and tries others from there: each from its prediction of first or second
/// order, and none that has jumped is believed.
class LinkageDesign {
 public:
  /// @param flat, deployed  conditions, without springs, loads and weight
  /// @param start  equilibria under them with these sizes, at least nearly
  /// @throws Error as DesignCriteria::validate, DesignLimits::validate, DesignVariables::validate,
  /// Conditions::validate with field flat. or deployed., set_sizes with field start.,
  /// TargetDistance. Also {kInvalidArgument} with field start.edges if edges differ and segments'
  /// lengths are to be varied, and {kFailedPrecondition} with field start if an equilibrium is not
  /// found from it
  LinkageDesign(const LinkageModel& model, Conditions flat, Conditions deployed, DesignPoint start,
                DesignCriteria criteria, DesignLimits limits = {}, DesignVariables variables = {});
  ~LinkageDesign();
  LinkageDesign(LinkageDesign&&) noexcept;
  LinkageDesign& operator=(LinkageDesign&&) noexcept;

  [[nodiscard]] const LinkageModel& model() const;
  [[nodiscard]] const Conditions& flat() const;
  [[nodiscard]] const Conditions& deployed() const;
  [[nodiscard]] const DesignPoint& point() const;
  [[nodiscard]] const DesignCriteria& criteria() const;

  [[nodiscard]] const DesignVariableMap& variables() const;
  /// p of the present point.
  [[nodiscard]] const Eigen::VectorXd& parameters() const;

  /// @param parameters  p
  [[nodiscard]] DesignTrial trial(const Eigen::VectorXd& parameters, const JobContext& context = {},
                                  Landing landing = Landing::kPredicted);
  [[nodiscard]] DesignValues values(const DesignPoint& point);
  /// Makes a trial's point the one where derivatives are taken.
  void move_to(DesignPoint point);
  /// New criteria at the same point; scales that are 0 keep their values.
  void set_criteria(DesignCriteria criteria);
  /// How often that has been done.
  [[nodiscard]] int criteria_revision() const;

  /// Measures to differentiate: all, or the objective and the flat energy in it. The others are
  /// then empty, or unchanged.
  enum class Which { kAll, kObjective };
  // At the present point, with the factors of the trial that led there, or of the start. Those of
  // other points are made anew.
  /// A solve for the deployed shape, and one for each constraint; once at a point. Without cells
  /// the area's derivatives are zero.
  [[nodiscard]] const DesignMeasures<Eigen::VectorXd>& gradients(Which which = Which::kAll);
  /// Second derivatives times a direction: six solves, or three for the objective alone.
  [[nodiscard]] DesignMeasures<Eigen::VectorXd> products(const Eigen::VectorXd& direction,
                                                         Which which = Which::kAll);
  /// Hessians that derivatives have had factored anew so far.
  [[nodiscard]] int factored_anew() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace limber::rods
