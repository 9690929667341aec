// Material of a motion that was made with a known one.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "bench/stability/sweep.h"
#include "engine/spacetime/recovery.h"
#include "tests/engine/spacetime/recovery_problems.h"

namespace limber::bench::stability {
namespace {

using spacetime::ModeDynamics;
using spacetime::RecoveredMotion;
using spacetime::Recovery;
using spacetime::RecoveryOptions;
using testing::eigenvalues;
using testing::free_motion;
using testing::three_modes;
using testing::unit_columns;

constexpr int kCoordinates = 6;

/// E_f + gamma E_c + mu E_s (space-time editing, 17a, 20, 23), written plainly.
double energy_of(const RecoveredMotion& at, const Eigen::MatrixXd& target,
                 const RecoveryOptions& options) {
  double energy = 0;
  for (Eigen::Index k = 0; k < at.z.rows(); ++k) {
    for (Eigen::Index i = 1; i + 1 < at.z.cols(); ++i) {
      const double force = at.z(k, i - 1) +
                           (-2 - at.dynamics.damping[k] + at.dynamics.stiffness[k]) * at.z(k, i) +
                           (1 + at.dynamics.damping[k]) * at.z(k, i + 1);
      energy += 0.5 * force * force;
    }
    const double square = at.mixing.col(k).squaredNorm() - 1;
    energy += options.column_weight * square * square;
  }
  return energy + 0.5 * options.weight * (at.mixing * at.z - target).squaredNorm();
}

/// A motion of these modes, recovered.
Finding recovered(const ModeDynamics& known, int frames, double scale) {
  const auto modes = static_cast<int>(known.stiffness.size());
  RecoveredMotion truth{scale * free_motion(known, frames), unit_columns(kCoordinates, modes, 1),
                        known};
  const Eigen::MatrixXd target = truth.mixing * truth.z;
  RecoveryOptions options;
  options.modes = modes;
  const Recovery result = recover(target, eigenvalues(kCoordinates), options);
  const RecoveredMotion& motion = result.motion;
  Finding finding;
  finding.claim = result.report.status == spacetime::RecoveryStatus::kConverged
                      ? Claim::kConverged
                      : Claim::kNotConverged;
  finding.is_finite = motion.z.allFinite() && motion.mixing.allFinite() &&
                      motion.dynamics.stiffness.allFinite() && motion.dynamics.damping.allFinite();
  // Over the energy of nothing, that is of z = 0 with columns of length one.
  const double rest = 0.5 * options.weight * target.squaredNorm();
  const double energy = energy_of(motion, target, options);
  finding.error = std::max(std::abs(energy - result.report.energies.total), energy) / rest;
  finding.allowed = 1e-4;  // the truth has none
  finding.message =
      fmt::format("{} steps, energy {:.2g} of that of rest. {}", result.report.steps, energy / rest,
                  result.report.message.empty() ? "step limit" : result.report.message);
  return finding;
}

ModeDynamics one_mode(double stiffness, double damping) {
  return {Eigen::VectorXd::Constant(1, stiffness), Eigen::VectorXd::Constant(1, damping)};
}

Sweep recovery_sweep(const char* name, const char* parameter, std::vector<double> values,
                     int required, std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "recovery";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.asked = "the material of a free motion of known modes";
  sweep.check =
      "the energy written plainly, which the known material makes zero; over that of rest";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps recovery_sweeps() {
  return {
      recovery_sweep("size of the motion", "amplitude", {1, 1e-3, 1e3, 1e-6, 1e6, 1e-9, 1e9, 1e-12},
                     4, [](double scale) { return recovered(three_modes(), 40, scale); }),
      recovery_sweep(
          "number of frames", "frames", {1e4, 1e3, 100, 40, 20, 12, 9, 8}, 4,
          [](double frames) { return recovered(three_modes(), static_cast<int>(frames), 1); }),
      recovery_sweep("slow swings", "stiffness [1/frame^2]", decades(-1, -10, -1), 4,
                     [](double stiffness) { return recovered(one_mode(stiffness, 0), 60, 1); }),
      recovery_sweep("swings near two frames", "4 - stiffness [1/frame^2]", decades(0, -8, -2), 3,
                     [](double rest) { return recovered(one_mode(4 - rest, 0), 60, 1); }),
      recovery_sweep("strong damping", "damping [1/frame]", decades(-3, 4), 4,
                     [](double damping) { return recovered(one_mode(0.3, damping), 60, 1); }),
      recovery_sweep("modes alike", "difference of two stiffnesses, relative", decades(0, -8, -1),
                     1,
                     [](double difference) {
                       ModeDynamics known = three_modes();
                       known.stiffness[1] = known.stiffness[0] * (1 + difference);
                       known.damping[1] = known.damping[0];
                       return recovered(known, 60, 1);
                     }),
  };
}

}  // namespace limber::bench::stability
