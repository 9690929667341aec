#include "engine/spacetime/fit_dynamics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/spacetime/fit_sampled.h"

namespace limber::spacetime {
namespace {

/// Velocity counts as proportional to displacement where its independent part is no more than this
/// of it, or than differences of neighbouring frames lose to rounding.
constexpr double kProportional = 1e-10;
constexpr double kRounding =
    8 * std::numeric_limits<double>::epsilon();  // relative, of differences of frames

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// Best multiple x of `column` in |acceleration + x column|^2, 0 <= x <= limit.
double best_multiple(const Eigen::RowVectorXd& acceleration, const Eigen::RowVectorXd& column,
                     double limit) {
  const double square = column.squaredNorm();
  return square > 0 ? std::clamp(-acceleration.dot(column) / square, 0.0, limit) : 0.0;
}

/// Components of the forces on a mode. For differences: acceleration + d velocity + lambda
/// position. For sampled modes the coefficients of ForceStencil are before, next - before, lambda.
struct Signals {
  Eigen::RowVectorXd position, velocity, acceleration;
};

/// @param all  z; of a cycle between its last frame and its first one
std::optional<Signals> signals_of(const Eigen::RowVectorXd& all) {
  if (!all.allFinite()) {
    throw Error(ErrorCode::kInvalidArgument, "z", "a motion has numbers that are not finite");
  }
  const Eigen::Index rows = all.size() - 2;
  const double size = all.size() > 0 ? all.cwiseAbs().maxCoeff() : 0;
  if (rows < 1 || size == 0) return std::nullopt;
  const Eigen::RowVectorXd unit = all / size;
  Signals signals;
  signals.position = unit.segment(1, rows);
  signals.velocity = unit.tail(rows) - signals.position;
  signals.acceleration = signals.velocity - (signals.position - unit.head(rows));
  if (signals.velocity.norm() <= kRounding * unit.norm()) signals.velocity.setZero();
  return signals;
}

ModeFit fit_differences(const Signals& signals, double max_stiffness) {
  const auto& [position, velocity, acceleration] = signals;
  // Both free: the part of the velocity that is independent of the position gives d.
  const double square = position.squaredNorm();
  if (square > 0) {
    Eigen::RowVectorXd apart = velocity;
    for (int pass = 0; pass < 2; ++pass) apart -= (apart.dot(position) / square) * position;
    if (apart.norm() > kProportional * velocity.norm() + kRounding * position.norm()) {
      const double damping = -acceleration.dot(apart) / apart.squaredNorm();
      const double stiffness = -(acceleration + damping * velocity).dot(position) / square;
      if (stiffness >= 0 && stiffness <= max_stiffness && damping >= 0) return {stiffness, damping};
    }
  }
  // The problem is convex: otherwise the minimum has one of the two at a bound.
  const auto cost = [&](const ModeFit& fit) {
    return (signals.acceleration + fit.damping * signals.velocity +
            fit.stiffness * signals.position)
        .squaredNorm();
  };
  ModeFit best{best_multiple(acceleration, position, max_stiffness), 0};
  const auto consider = [&](const ModeFit& fit) {
    if (cost(fit) < cost(best)) best = fit;
  };
  consider({0, best_multiple(acceleration, velocity, kUnbounded)});
  if (max_stiffness < kUnbounded) {
    const Eigen::RowVectorXd held = acceleration + max_stiffness * position;
    consider({max_stiffness, best_multiple(held, velocity, kUnbounded)});
  }
  return best;
}

}  // namespace

ModeFit fit_mode(const Eigen::Ref<const Eigen::RowVectorXd>& z, double max_stiffness) {
  FitOptions options;
  options.max_stiffness = max_stiffness;
  return fit_mode(z, options);
}

ModeFit fit_mode(const Eigen::Ref<const Eigen::RowVectorXd>& z, const FitOptions& options) {
  const bool is_cyclic = options.beginning == Beginning::kCyclic && z.size() > 0;
  Eigen::RowVectorXd all(z.size() + (is_cyclic ? 2 : 0));
  if (is_cyclic) {
    all << z.tail<1>(), z, z.head<1>();
  } else {
    all = z;
  }
  std::optional<Signals> signals = signals_of(all);
  if (!signals) return {};
  if (options.smoothing > 0) {
    const auto smoothed = is_cyclic ? smoothed_cycle : smoothed_forces;
    for (auto* signal : {&signals->position, &signals->velocity, &signals->acceleration})
      *signal = smoothed(*signal, options.smoothing);
  }
  if (options.discretisation == Discretisation::kDifferences)
    return fit_differences(*signals, options.max_stiffness);
  Eigen::MatrixX3d columns(signals->position.size(), 3);
  columns << signals->acceleration.transpose(), signals->velocity.transpose(),
      signals->position.transpose();
  const Eigen::Vector2d first = z.head(2).transpose() / z.cwiseAbs().maxCoeff();
  return fit_sampled(columns, first, options);
}

ModeFit bounded_fit(const ModeFit& fit, const FitOptions& options) {
  if (options.discretisation == Discretisation::kDifferences)
    return {std::min(fit.stiffness, options.max_stiffness), fit.damping};
  const double most = std::min(options.max_stiffness, FitOptions::kGreatestSampledStiffness);
  ModeFit result = fit;
  if (fit.stiffness > most) {
    result.stiffness = most;
    result.damping *= std::sqrt(most / fit.stiffness);
  }
  const double critical = 2 * std::sqrt(result.stiffness);
  result.damping = std::clamp(result.damping, FitOptions::kLeastDampingRatio * critical,
                              FitOptions::kGreatestDampingRatio * critical);
  return result;
}

}  // namespace limber::spacetime
