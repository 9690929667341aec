#pragma once

#include <Eigen/Core>
#include <string>

#include "engine/base/job.h"
#include "engine/scene/scene.h"
#include "engine/session/bodies/session.h"
#include "engine/spacetime/recovery.h"

namespace limber::session {

/// Settings of a recovery besides the scene.
struct RecoveryRequest {
  spacetime::MaterialVariables variables = spacetime::MaterialVariables::kAll;
  spacetime::RecoveryStart start = spacetime::RecoveryStart::kPrincipalComponents;
  /// The first frames, that the material is recovered from: at least 8 more than are driven, at
  /// most those of the base motion. 0: the first half of it.
  int recovered_frames = 0;
  int driven_frames = 0;        // of the first: forces are known to act there, >= 0
  double weight = 1;            // gamma, > 0
  double column_weight = 1e-8;  // mu, > 0
  int total_frames = 0;         // of the recovered and continued motion; 0: as the base motion

  /// The same with the defaults in place of 0.
  /// @param base_frames  of the base motion
  /// @throws Error{kInvalidArgument} naming the member, its value and the rule
  [[nodiscard]] RecoveryRequest resolved(int base_frames) const;
};

/// How a recovery went. Errors are of displacements, relative to those of the same frames of the
/// base motion; 0 where both rest, 1 where only the base motion does.
struct RecoveryReport {
  int recovered_frames = 0;
  double frames_per_second = 30;
  /// Lambda and D of the swings of r modes (spacetime::Recovery), after six rigid motions of a free
  /// body, for which both are 0.
  spacetime::ModeDynamics dynamics;
  /// S, R x r; of a free body (R + 6) x (r + 6), the identity for the rigid motions.
  Eigen::MatrixXd mixing;
  bool converged = false;
  int steps = 0;
  spacetime::RecoveryEnergies energies;
  /// Error of the base motion as its modal coordinates reconstruct it, over all frames: the part of
  /// the errors below that no material could avoid.
  double projection_error = 0;
  double recovered_error = 0;    // of the frames that the material is recovered from
  double continued_error = 0;    // of the frames behind them; 0 where there are none
  double final_frame_error = 0;  // of the last one of those
  std::string message;           // what the user should know; empty if nothing
};

/// A recovered and continued motion on the mesh as the client sent it.
struct MaterialRecovery {
  Geometry geometry;          // without a basis
  Eigen::MatrixXd positions;  // 3 source nodes x frames, 3 * node + axis [scene units]
  RecoveryReport report;
};

/// The material of a scene's base motion (paper: space-time editing, section 6.3), and how the
/// motion continues with it without forces. The r = model.mode_count modes are mixed from R =
/// candidate modes (ModelRequest::kDefaultCandidates, or as many as the mesh has). Candidates use
/// the scene's materials. Without these they are the modes of a uniform body, for which only
/// Poisson's ratio matters (the paper's E = 1, rho = 1: modes do not depend on either, and of
/// eigenvalues only ratios count).
///
/// Shapes are full RS reconstructions and poses are projected over all tets, so that no basis and
/// no cubature has to be built. A free body's rigid motions are no matter of its material: they are
/// those of the base motion, and continue with the velocity of the last two frames. A motion that
/// is zero stays zero, with lambda = d = 0.
/// @param scene  valid (scene::validate); constraints, ends and a simulation are not looked at
/// @throws Error{kInvalidArgument} naming "base_motion" where the scene has none, members of
/// RecoveryRequest, and what the mesh is refused for; {kNumerical}; {kCancelled}
[[nodiscard]] MaterialRecovery recover(const scene::Scene& scene, const RecoveryRequest& request,
                                       const JobContext& job = {});

}  // namespace limber::session
