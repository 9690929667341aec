#include "engine/spacetime/recovery.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "engine/base/clauses.h"
#include "engine/base/degrees.h"
#include "engine/base/error.h"
#include "engine/spacetime/force_rows.h"
#include "engine/spacetime/recovery_energy.h"
#include "engine/spacetime/recovery_start.h"
#include "engine/spacetime/recovery_step.h"
#include "engine/spacetime/recovery_swings.h"

namespace limber::spacetime {
namespace {

constexpr Eigen::Index kLeastFrames = 8;  // that a target must have
/// An energy of this share of the target's own is rounding.
constexpr double kNegligibleEnergy = 1e-20;
/// Energies that differ by less do not say which of two recoveries has separated its modes.
constexpr double kAlikeEnergies = 0.01;
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
           const RecoveryOptions& options) {
  const int modes = options.modes;
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
  if (warm.dynamics.discretisation != options.discretisation ||
      warm.dynamics.smoothing != options.smoothing)
    refuse("warm", "the motion to begin with has other forces than the recovery");
}

/// With the forces that the options say.
RecoveredMotion formed(RecoveredMotion start, const RecoveryOptions& options) {
  start.dynamics.discretisation = options.discretisation;
  start.dynamics.smoothing = options.smoothing;
  return start;
}

/// Lambda, D and z that fit S.
RecoveredMotion fitted(RecoveredMotion start, const RecoveryEnergy& energy,
                       const RecoveryOptions& options) {
  start = formed(std::move(start), options);
  energy.fit_dynamics(start);
  energy.fit_motion(start);
  return start;
}

RecoveredMotion begin_in_components(const RecoveryEnergy& energy, const RecoveryOptions& options) {
  RecoveredMotion result = fitted(principal_start(energy.target(), options.modes), energy, options);
  auto separated = separated_start(energy.target(), options.modes, options.driven_frames);
  if (!separated) return result;
  RecoveredMotion other = fitted(std::move(*separated), energy, options);
  return energy.value(other).total < energy.value(result).total ? other : result;
}

/// A mode whose motion coupled modes explain far better than its own stiffness and damping do: it
/// swings with several frequencies. Empty: there is none.
std::string describe_mixed_modes(const RecoveredMotion& motion, Eigen::Index driven) {
  const Eigen::Index count = motion.z.cols() - 2 - driven;
  const auto coupled = motion.z.rows() > 1 ? fit_oscillator(motion.z, driven) : std::nullopt;
  if (!coupled) return {};
  const Eigen::MatrixXd now = motion.z.middleCols(driven + 1, count),
                        change = motion.z.middleCols(driven + 2, count) - now,
                        acceleration = change - now + motion.z.middleCols(driven, count);
  const Eigen::ArrayXd size = acceleration.rowwise().squaredNorm().array().max(1e-300);
  Eigen::ArrayXd alone(motion.z.rows());
  for (Eigen::Index k = 0; k < alone.size(); ++k) {
    const ForceStencil stencil = force_stencil(motion.dynamics, k);
    // Accelerations of sampled modes count q times (ForceStencil).
    const bool is_sampled = motion.dynamics.discretisation == Discretisation::kSampled;
    const double gain = is_sampled ? stencil.next : 1.0;
    const Eigen::RowVectorXd force = stencil.before * acceleration.row(k) +
                                     (stencil.next - stencil.before) * change.row(k) +
                                     motion.dynamics.stiffness[k] * now.row(k);
    alone[k] = force.squaredNorm() / (gain * gain * size[k]);
  }
  const Eigen::ArrayXd together =
      (acceleration + coupled->stiffness * now + coupled->damping * change)
          .rowwise()
          .squaredNorm()
          .array() /
      size;
  constexpr double kVisible = 1e-3, kFarBetter = 0.1;
  Eigen::Index worst = -1;
  for (Eigen::Index k = 0; k < alone.size(); ++k) {
    const bool is_mixed = alone[k] >= kVisible && together[k] <= kFarBetter * alone[k];
    if (is_mixed && (worst < 0 || alone[k] > alone[worst])) worst = k;
  }
  if (worst < 0) return {};
  Eigen::ArrayXd pull =
      coupled->stiffness.row(worst).transpose().array().abs() * now.rowwise().norm().array();
  pull[worst] = -1;
  Eigen::Index other = 0;
  pull.maxCoeff(&other);
  return fmt::format(
      "the modes were not separated: forces leave {:.2g} % of the accelerations of mode {}, and "
      "coupled modes {:.2g} %; modes {} and {} are coupled most. Do not rely on their frequencies "
      "and "
      "on the continuation: recover from more frames, or from another start",
      100 * alone[worst], worst + 1, 100 * together[worst], std::min(worst, other) + 1,
      std::max(worst, other) + 1);
}

RecoveredMotion begin(const RecoveryEnergy& energy, const Eigen::VectorXd& eigenvalues,
                      const RecoveryOptions& options) {
  const bool principal = options.variables == MaterialVariables::kAll &&
                         options.start == RecoveryStart::kPrincipalComponents;
  if (principal) return begin_in_components(energy, options);
  RecoveredMotion result =
      formed(spectrum_start(energy.target(), eigenvalues, options.modes), options);
  energy.fit_motion(result);
  return result;
}

/// To a minimum, or to the limit of steps.
Recovery descend(const RecoveryEnergy& energy, RecoveredMotion start,
                 const RecoveryOptions& options, const JobContext& job) {
  Recovery result;
  RecoveredMotion& motion = result.motion;
  RecoveryReport& report = result.report;
  motion = std::move(start);
  report.start = energy.value(motion);
  if (options.variables == MaterialVariables::kMotion) {
    energy.fit_motion(motion);
    report.status = RecoveryStatus::kConverged;
    report.steps = 1;
  }
  RecoveryStep step(energy);
  const double nothing = kNegligibleEnergy * 0.5 * options.weight * energy.target().squaredNorm();
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
  return result;
}

Recovery of_no_motion(Eigen::Index coordinates, Eigen::Index frames,
                      const RecoveryOptions& options) {
  const int modes = options.modes;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(modes);
  Recovery result;
  result.motion = {Eigen::MatrixXd::Zero(modes, frames),
                   Eigen::MatrixXd::Identity(coordinates, modes),
                   {none, none, options.discretisation, options.smoothing}};
  result.swings = result.motion;
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
  if (!is_discretisation(discretisation))
    refuse("discretisation", "discretisation is not a discretisation");
  require(is_smoothing(smoothing), "smoothing", smoothing, "in [0, 1e6]");
  require(tolerance > 0 && tolerance < 1, "tolerance", tolerance, "in (0, 1)");
  require(max_steps > 0, "max_steps", max_steps, "> 0");
}

Recovery recover(const Eigen::Ref<const Eigen::MatrixXd>& target,
                 const Eigen::VectorXd& eigenvalues, const RecoveryOptions& options,
                 const JobContext& job, const RecoveredMotion* warm) {
  check(target, eigenvalues, options);
  if (warm != nullptr) check(*warm, target, options);
  if (target.isZero(0)) return of_no_motion(target.rows(), target.cols(), options);

  const RecoveryEnergy energy(target, options);
  Recovery result =
      descend(energy, warm != nullptr ? *warm : begin(energy, eigenvalues, options), options, job);
  std::vector<ModeSwing> swings;
  if (options.variables != MaterialVariables::kMotion)
    swings = fit_swings(result.motion, options.driven_frames);
  const bool is_default = warm == nullptr && options.variables == MaterialVariables::kAll &&
                          options.start == RecoveryStart::kPrincipalComponents;
  if (is_default) {
    // Near-equal frequencies may stay mixed from components: the published start is tried, too.
    RecoveryOptions other = options;
    other.start = RecoveryStart::kSpectrum;
    Recovery published = descend(energy, begin(energy, eigenvalues, other), options, job);
    auto published_swings = fit_swings(published.motion, options.driven_frames);
    const double before = result.report.energies.total, now = published.report.energies.total;
    const bool is_better = std::abs(now - before) < kAlikeEnergies * before
                               ? share_not_free(published.motion, published_swings, eigenvalues) <
                                     share_not_free(result.motion, swings, eigenvalues)
                               : now < before;
    if (is_better) {
      result = std::move(published);
      swings = std::move(published_swings);
    }
  }
  RecoveryReport& report = result.report;
  if (report.status == RecoveryStatus::kStepLimit) {
    report.message = fmt::format("not converged: stopped after {} steps", report.steps);
  }
  result.swings = result.motion;
  if (options.variables == MaterialVariables::kMotion) return result;
  result.swings = swinging(result.motion, swings);
  std::string mixed = describe_mixed_modes(result.motion, options.driven_frames);
  if (mixed.empty()) mixed = describe_several_frequencies(result.motion, swings, eigenvalues);
  append_clause(report.message, mixed);
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
    const bool is_sampled = motion.dynamics.discretisation == Discretisation::kSampled;
    if (!is_sampled && lambda > 4 + 2 * d) {
      lambda = 3 + 1.5 * d;
      ++result.bounded_modes;
    }
    const ForceStencil stencil = force_stencil(motion.dynamics.discretisation, lambda, d);
    double before = motion.z(k, motion.z.cols() - 2), now = motion.z(k, motion.z.cols() - 1);
    for (Eigen::Index i = 0; i < frames; ++i) {
      const double next = -(stencil.centre * now + stencil.before * before) / stencil.next;
      before = now;
      result.z(k, i) = now = next;
    }
  }
  return result;
}

Continuation continue_freely(const Recovery& recovery, int frames) {
  Continuation result = continue_freely(recovery.swings, frames);
  RecoveredMotion rest = recovery.swings;
  rest.z = recovery.motion.z - recovery.swings.z;
  const Eigen::MatrixXd beside = continue_freely(rest, frames).z;
  for (Eigen::Index k = 0; k < beside.rows(); ++k) {
    const ModeDynamics& dynamics = recovery.swings.dynamics;
    const double per_frame =
        frequency_of(dynamics.stiffness[k], dynamics.discretisation) * kFullTurn / 4;
    for (Eigen::Index i = 0; i < frames; ++i) {
      const double angle = static_cast<double>(i + 1) * per_frame;
      if (angle < kFullTurn / 4) result.z(k, i) += std::pow(std::cos(angle), 2) * beside(k, i);
    }
  }
  return result;
}

}  // namespace limber::spacetime
