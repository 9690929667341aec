#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/beams/structure/beam_state.h"

// Input and output of the solvers of beam structures.

namespace limber::beams {

enum class BeamStatus {
  kConverged,       // forces and moments balance, and the energy rises in every direction
  kStalled,         // no progress that rounding would not explain, yet no balance
  kUnstable,        // grew without bound, or balance at a saddle was all that could be found
  kMechanism,       // part of the structure moves without any resistance
  kIterationLimit,  //
  kCancelled,       // the state is the last one reached
};
[[nodiscard]] const char* to_string(BeamStatus status) noexcept;

enum class BeamMethod {
  /// Newton's method along the branch of equilibria, or relaxation first where temporary loads have
  /// to choose among many buckling modes; the other where that fails.
  kChoose,
  kNewton,                // load steps, each solved by Newton's method
  kRelaxation,            // dynamic relaxation with kinetic damping
  kRelaxationThenNewton,  // the relaxation until Newton's method takes over
};
[[nodiscard]] const char* to_string(BeamMethod method) noexcept;

/// When elements that are too long to show how they buckle are judged by shorter ones. It may take
/// as long as the solve.
enum class FinerJudgement {
  kAtOnce,
  kLeft,  // to a call of judge_by_shorter_elements()
};

struct BeamSolveOptions {
  BeamMethod method = BeamMethod::kChoose;
  FinerJudgement finer_judgement = FinerJudgement::kAtOnce;
  /// Balance: the largest residual force over the forces present, and moment over the moments
  /// present; in (0, 1).
  double tolerance = 1e-8;
  double relaxation_tolerance = 1e-6;  // the same, for relaxation that Newton does not finish
  int newton_iterations = 500;         // over all load steps, > 0; 3000 where a branch is followed
  int relaxation_steps = 1000000;      // > 0
  /// Steps of relaxation over which loads and motions are brought on where nothing is pressed; up
  /// to twenty times as many where elements are, so that they do not fold up; >= 0.
  int ramp_steps = 200;
  /// First load step of Newton's method, as a share of everything; in (0, 1].
  double first_load_step = 1;
  /// Relaxation hands over to Newton at this residual; in (0, 1).
  double hand_over = 2e-4;
  /// Load steps of Newton's method are cut until the structure continues as in the step before, but
  /// for this much turning [rad], in [0, 3]. A swerve that no cutting makes smaller is a snap
  /// unless it reverses. With 0 only kChoose looks at swerves, and takes the value of following().
  double largest_swerve = 0;
  /// If steps are watched for swerves: share of the path to which the end of a branch is located;
  /// in (0, 1]. A longer one takes less work.
  double snap_resolution = kFineResolution;
  static constexpr double kFineResolution = 1.0 / 8192;  // of the load path
  /// Factorizations over all load steps: the solve ends at the last load step that this many allow,
  /// >= 0. A value of 0 is no limit, except for kChoose, which then takes a number by size.
  int factorizations = 0;

  /// Newton's method follows the branch of equilibria, and tells its snaps.
  [[nodiscard]] static BeamSolveOptions following() noexcept;
  /// The same for edits that somebody waits for: of more than 250 elements ends of branches are
  /// located to 1/64, and work is bounded by the number of elements. Never by time: answers are the
  /// same on any machine.
  [[nodiscard]] static BeamSolveOptions live(int elements) noexcept;

  /// The options of kChoose: no more factorizations and steps of the relaxation than suit the
  /// number of elements, so that large structures end, too.
  [[nodiscard]] BeamSolveOptions bounded_by_size(int elements) const noexcept;

  /// @throws Error{kInvalidArgument} naming member, value and inequality
  void validate() const;
};

/// A state along the path: after a load step, or every few steps of the relaxation.
struct BeamProgress {
  const BeamState* state = nullptr;
  double load_factor = 0;  // share of loads and motions that is on, in [0, 1]
  double residual = 0;     // scaled, as the tolerance
  int step = 0;            // load steps, or relaxation steps
};
using BeamObserver = std::function<void(const BeamProgress&)>;

/// Place along the load path where the branch of equilibria ended and the structure went to
/// another, with a loss of energy. When loads are taken back it does not return. Buckling is
/// continuous.
struct BeamSnap {
  double load_factor = 0;
  double turn = 0;  // of a node, or of an element's chord, the largest [rad]
  int node = -1;    // where that is
};

/// An equilibrium is one of a family of equal energy: the material resists this direction, and the
/// forces that the structure carries take back exactly as much. Scaled so that the largest turn of
/// a node, or of an element's chord, is 1 rad.
struct BeamNeutralDirection {
  int node = -1;                // that moves most
  Eigen::Vector3d translation;  // of it, in global axes [length]
  Eigen::Vector3d rotation;     // [rad]
};

struct BeamReport {
  BeamStatus status = BeamStatus::kIterationLimit;
  BeamMethod method = BeamMethod::kChoose;  // which one gave the answer; never kChoose
  int newton_iterations = 0;
  int factorizations = 0;
  int load_steps = 0;
  int relaxation_steps = 0;
  double residual = 0;     // largest scaled force or moment that is left
  double load_factor = 0;  // 1 where everything is on
  /// If a branch of equilibria was followed: share of loads and motions up to which one was found,
  /// 1 where the answer is one. Below load_factor where the rest balances without being an
  /// equilibrium: elements too long to resolve it, or a mechanism.
  std::optional<double> equilibrium_share;
  double elastic_energy = 0;  // [force length]
  /// For the stiffness at the answer, those of rounding left out: 0 at a minimum. Under loads that
  /// follow, and moments of fixed direction on nodes that turn about several axes, directions that
  /// diverge instead. None where the state is no equilibrium under all loads and motions, at a
  /// mechanism, and where that is not judged.
  std::optional<int> negative_eigenvalues;
  int node = -1;        // that moves most freely (mechanism), buckles, or is worst balanced
  std::string message;  // a sentence for people
  /// In order, as found by Newton's method where it followed the branch.
  std::vector<BeamSnap> snaps;
  /// Share of loads and motions, to 1 %, at which the followed branch first became unstable and
  /// continued in another that begins there. It is empty if the branch did not, or if that was not
  /// located.
  std::optional<double> buckling_share;

  /// Neutral directions of the answer; empty if there are none. Temporary loads choose the member
  /// of the family, or else the smallest change.
  std::vector<BeamNeutralDirection> neutral_directions;
  /// Elements too long to show how they buckle by themselves, where shorter ones could not judge it
  /// or say that the answer is unstable.
  std::vector<int> unjudged_elements;

  /// Balanced, but by elements too long for their deformation: shorter ones would tell.
  bool is_unresolved = false;

  [[nodiscard]] bool converged() const { return status == BeamStatus::kConverged; }
};

struct BeamSolution {
  BeamState state;
  BeamReport report;
};

}  // namespace limber::beams
