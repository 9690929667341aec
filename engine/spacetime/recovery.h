#pragma once

#include <Eigen/Core>
#include <string>

#include "engine/base/job.h"
#include "engine/spacetime/material.h"

namespace limber::spacetime {

/// The start of a recovery of all variables; other recoveries have S = (I; 0) and the paper's
/// start.
enum class RecoveryStart {
  /// S: principal components of the motion (left singular vectors). They are unchanged, or in the
  /// modes of the coupled oscillator that explains the motion best there; the start of lower energy
  /// is taken. Lambda and D are those that need least force for them. The recovery from kSpectrum
  /// is taken instead if it ends lower by 1 %; within 1 %, if its modes swing more freely.
  kPrincipalComponents,
  /// The paper's (section 6.3): S = (I; 0), D = 0, Lambda the eigenvalues. They are scaled so that
  /// the mode with most energy in its spectrum swings with the frequency that is strongest there.
  /// In the paper the maximum includes the mean of the motion, which would make Lambda = 0 for a
  /// body that swings about a bent pose. Here the mean does not count.
  kSpectrum,
};

struct RecoveryOptions {
  int modes = 10;  // r, > 0, at most R
  MaterialVariables variables = MaterialVariables::kAll;
  RecoveryStart start = RecoveryStart::kPrincipalComponents;
  double weight = 1;            // gamma of E_c^RS, in [1e-12, 1e12]
  double column_weight = 1e-8;  // mu of E_s, in [1e-30, 1e12]
  /// Number of first frames, >= 0, in which forces are known to act (someone pushes), so that
  /// forces there do not count. 0 is the paper's E_f.
  int driven_frames = 0;
  /// The form of E_f and of the recovered dynamics (ModeDynamics). With sampled modes recovered
  /// lambda and damping ratios have the bounds of FitOptions.
  Discretisation discretisation = Discretisation::kDifferences;
  double smoothing = 0;     // tau [frames], in [0, 1e6]
  double tolerance = 1e-6;  // a step that gains less of the energy is the last, in (0, 1)
  int max_steps = 300;      // > 0

  /// @throws Error{kInvalidArgument} naming the member, its value and the inequality
  void validate() const;
};

/// A motion z^ = S z of R modes and the material that explains it.
struct RecoveredMotion {
  Eigen::MatrixXd z;       // r x N
  Eigen::MatrixXd mixing;  // S, R x r
  ModeDynamics dynamics;   // Lambda, D
};

struct RecoveryEnergies {
  double force = 0;       // E_f (17a), over the frames that are not driven
  double constraint = 0;  // E_c^RS (23)
  double columns = 0;     // E_s (20)
  double total = 0;       // E_f + gamma E_c^RS + mu E_s
};

enum class RecoveryStatus { kConverged, kStepLimit };

struct RecoveryReport {
  RecoveryStatus status = RecoveryStatus::kStepLimit;
  int steps = 0;
  RecoveryEnergies start, energies;
  std::string message;  // a note for the user; empty if none
};

struct Recovery {
  RecoveredMotion motion;
  /// The free swing that each mode's motion is nearest to, with its stiffness and damping. Least
  /// force biases Lambda and D if the motion contains other frequencies, as in a body that moves
  /// far. Modes of which a swing does not explain half have the dynamics of `motion`; frames that
  /// are driven are those of `motion`. With kMotion: as `motion`.
  RecoveredMotion swings;
  RecoveryReport report;
};

/// Material of a motion (paper: space-time editing, section 6.3): minimises
///   E_f(z, Lambda, D) + gamma E_c^RS(S, z) + mu E_s(S),   lambda, d >= 0,
/// over what the options say. The energy never rises from step to step (see NOTATION.md). A motion
/// that is zero is its own answer: z, Lambda and D are zero, S = (I; 0).
///
/// Cost of a step: r^4 N, memory r^3 N numbers; without S, r^3 N.
/// @param target       z-bar, R x N: modal RS coordinates of the motion (reduced::ModalProjector)
/// @param eigenvalues  R, of the modes, ascending, >= 0 (only their ratios matter)
/// @param warm         where to begin instead of options.start; S is taken from it in all cases
/// @throws Error{kInvalidArgument} naming the option, `target` (fewer than 8 frames that are not
/// driven, numbers that are not finite), `modes` (R < r), `eigenvalues` or `warm`;
/// Error{kCancelled}
[[nodiscard]] Recovery recover(const Eigen::Ref<const Eigen::MatrixXd>& target,
                               const Eigen::VectorXd& eigenvalues, const RecoveryOptions& options,
                               const JobContext& job = {}, const RecoveredMotion* warm = nullptr);

struct Continuation {
  Eigen::MatrixXd z;  // r x frames
  /// Number of modes whose recurrence would explode (differences with lambda > 4 + 2 d). Their
  /// lambda is set to three quarters of this limit, where the swing of two frames does not grow.
  int bounded_modes = 0;
};

/// How the motion continues without force after its last two frames:
///   next z_(i+1) = -centre z_i - before z_(i-1)    (ForceStencil).
/// @throws Error{kInvalidArgument} naming `frames` (>= 0) or `motion` (fewer than 2 frames)
[[nodiscard]] Continuation continue_freely(const RecoveredMotion& motion, int frames);

/// The same of the swings. The rest of the motion in its last two frames continues with their
/// stiffness and damping and fades within one swing.
[[nodiscard]] Continuation continue_freely(const Recovery& recovery, int frames);

}  // namespace limber::spacetime
