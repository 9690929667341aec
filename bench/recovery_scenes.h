#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "bench/suite.h"

namespace limber::bench {

/// A motion of a body whose material is not uniform, simulated in full (St. Venant-Kirchhoff), as
/// the recovery of material starts from (space-time editing, section 6.3).
struct RecoveryScene {
  std::string name;
  bodies::ElasticBody generic;  // E = 1 Pa, nu = 0.45, rho = 1 kg/m^3 throughout: body of the modes
  Eigen::MatrixXd displacements;  // 3n x frames [m]
  int driven_frames = 0;          // of the first frames: loads act
  double frames_per_second = 0;
  double largest = 0;  // displacement of a node in any frame, in body lengths
  double simulation_ms = 0;
};

/// "beam": mesh.elastic (7 MPa at the fixed end, 50 kPa at the free one), pushed up at its end for
/// 15 frames, down for 15, then left alone. For "dino": mesh.elastic (200 kPa to 10 MPa), feet
/// fixed, released from the deformed position under a sideways acceleration.
///
/// The paper gives no parameters. Here a swing of the body's lowest mode takes 30 frames and loses
/// 2 pi % of its amplitude (1 % of critical damping, Kelvin-Voigt: higher modes lose more). There
/// is one step of the implicit midpoint rule a frame. Loads move something by about a tenth of the
/// body's length, times `share`.
/// @returns nothing where the public data is not there
[[nodiscard]] std::optional<RecoveryScene> recovery_scene(const std::string& name, int frames,
                                                          const SuiteOptions& options,
                                                          double share = 1);

}  // namespace limber::bench
