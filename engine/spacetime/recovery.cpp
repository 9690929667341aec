#include "engine/spacetime/recovery.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/spacetime/recovery_energy.h"
#include "engine/spacetime/recovery_start.h"
#include "engine/spacetime/recovery_step.h"

namespace limber::spacetime {
namespace {

constexpr Eigen::Index kLeastFrames = 8;  // that a target must have
/// An energy of this share of the target's own is rounding.
constexpr double kNegligibleEnergy = 1e-20;
// Beyond them the other energies are lost in rounding.
constexpr double kLeastWeight = 1e-12, kGreatestWeight = 1e12, kLeastColumnWeight = 1e-30;

template <class T>
void require(bool holds, const char* member, T value, const char* inequality) {
  if (!holds) {
    throw Error(ErrorCode::kInvalidArgument, member,
                fmt::format("{} = {}, must be {}", member, value, inequality));
  }
}

void refuse(const char* field, const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, field, message);
}

void check(const Eigen::Ref<const Eigen::MatrixXd>& target, const Eigen::VectorXd& eigenvalues,
           const RecoveryOptions& options) {
  options.validate();
  if (target.cols() - options.driven_frames < kLeastFrames) {
    refuse("target", fmt::format("a recovery needs {} frames that are not driven, there are {} "
                                 "frames and {} of them are driven",
                                 kLeastFrames, target.cols(), options.driven_frames));
  }
  if (!target.allFinite()) refuse("target", "the motion has numbers that are not finite");
  if (options.modes > target.rows()) {
    refuse("modes", fmt::format("modes = {}, but the motion has only R = {} coordinates",
                                options.modes, target.rows()));
  }
  if (eigenvalues.size() != target.rows() || !eigenvalues.allFinite() ||
      (eigenvalues.array() < 0).any()) {
    refuse("eigenvalues",
           fmt::format("{} numbers >= 0 are needed, one for each coordinate", target.rows()));
  }
}

void check(const RecoveredMotion& warm, const Eigen::Ref<const Eigen::MatrixXd>& target,
           int modes) {
  const bool fits = warm.z.rows() == modes && warm.z.cols() == target.cols() &&
                    warm.mixing.rows() == target.rows() && warm.mixing.cols() == modes &&
                    warm.dynamics.stiffness.size() == modes &&
                    warm.dynamics.damping.size() == modes;
  if (!fits) refuse("warm", "the motion to begin with has other sizes than the recovery");
  const bool valid = warm.z.allFinite() && warm.mixing.allFinite() &&
                     warm.dynamics.stiffness.allFinite() && warm.dynamics.damping.allFinite() &&
                     (warm.dynamics.stiffness.array() >= 0).all() &&
                     (warm.dynamics.damping.array() >= 0).all();
  if (!valid) refuse("warm", "stiffness and damping must be >= 0 and all numbers finite");
}

RecoveredMotion begin(const RecoveryEnergy& energy, const Eigen::VectorXd& eigenvalues,
                      const RecoveryOptions& options) {
  const bool principal = options.variables == MaterialVariables::kAll &&
                         options.start == RecoveryStart::kPrincipalComponents;
  RecoveredMotion result = principal ? principal_start(energy.target(), options.modes)
                                     : spectrum_start(energy.target(), eigenvalues, options.modes);
  if (principal) energy.fit_dynamics(result);
  energy.fit_motion(result);
  return result;
}

Recovery of_no_motion(Eigen::Index coordinates, Eigen::Index frames, int modes) {
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(modes);
  Recovery result;
  result.motion = {Eigen::MatrixXd::Zero(modes, frames),
                   Eigen::MatrixXd::Identity(coordinates, modes),
                   {none, none}};
  result.report.status = RecoveryStatus::kConverged;
  result.report.message = "the motion is zero: it says nothing about the material";
  return result;
}

}  // namespace

void RecoveryOptions::validate() const {
  require(modes > 0, "modes", modes, "> 0");
  require(weight >= kLeastWeight && weight <= kGreatestWeight, "weight", weight,
          "in [1e-12, 1e12]");
  require(column_weight >= kLeastColumnWeight && column_weight <= kGreatestWeight, "column_weight",
          column_weight, "in [1e-30, 1e12]");
  require(driven_frames >= 0, "driven_frames", driven_frames, ">= 0");
  require(tolerance > 0 && tolerance < 1, "tolerance", tolerance, "in (0, 1)");
  require(max_steps > 0, "max_steps", max_steps, "> 0");
}

Recovery recover(const Eigen::Ref<const Eigen::MatrixXd>& target,
                 const Eigen::VectorXd& eigenvalues, const RecoveryOptions& options,
                 const JobContext& job, const RecoveredMotion* warm) {
  check(target, eigenvalues, options);
  if (warm != nullptr) check(*warm, target, options.modes);
  if (target.isZero(0)) return of_no_motion(target.rows(), target.cols(), options.modes);

  const RecoveryEnergy energy(target, options);
  Recovery result;
  RecoveredMotion& motion = result.motion;
  RecoveryReport& report = result.report;
  motion = warm != nullptr ? *warm : begin(energy, eigenvalues, options);
  report.start = energy.value(motion);
  if (options.variables == MaterialVariables::kMotion) {
    energy.fit_motion(motion);
    report.status = RecoveryStatus::kConverged;
    report.steps = 1;
  }
  RecoveryStep step(energy);
  const double nothing = kNegligibleEnergy * 0.5 * options.weight * target.squaredNorm();
  double now = report.start.total;
  while (report.status != RecoveryStatus::kConverged && report.steps < options.max_steps) {
    job.report("recovering material", static_cast<double>(report.steps) / options.max_steps);
    double gained = 0;
    if (options.variables == MaterialVariables::kAll) {
      gained = step.take(motion, job);
      now -= gained;
    } else {
      energy.fit_dynamics(motion);
      energy.fit_motion(motion);
      const double before = now;
      now = energy.value(motion).total;
      gained = before - now;
    }
    ++report.steps;
    if (gained <= options.tolerance * now || now <= nothing)
      report.status = RecoveryStatus::kConverged;
  }
  report.energies = energy.value(motion);
  if (report.status == RecoveryStatus::kStepLimit) {
    report.message = fmt::format("not converged: stopped after {} steps", report.steps);
  }
  return result;
}

Continuation continue_freely(const RecoveredMotion& motion, int frames) {
  if (frames < 0) refuse("frames", fmt::format("frames = {}, must be >= 0", frames));
  if (motion.z.cols() < 2) refuse("motion", "a motion needs two frames to be continued");
  Continuation result;
  result.z.resize(motion.z.rows(), frames);
  for (Eigen::Index k = 0; k < motion.z.rows(); ++k) {
    const double d = motion.dynamics.damping[k];
    double lambda = motion.dynamics.stiffness[k];
    if (lambda > 4 + 2 * d) {
      lambda = 3 + 1.5 * d;
      ++result.bounded_modes;
    }
    double before = motion.z(k, motion.z.cols() - 2), now = motion.z(k, motion.z.cols() - 1);
    for (Eigen::Index i = 0; i < frames; ++i) {
      const double next = ((2 + d - lambda) * now - before) / (1 + d);
      before = now;
      result.z(k, i) = now = next;
    }
  }
  return result;
}

}  // namespace limber::spacetime
