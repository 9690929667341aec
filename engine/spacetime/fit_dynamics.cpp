#include "engine/spacetime/fit_dynamics.h"

#include <algorithm>
#include <limits>

#include "engine/base/error.h"

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

}  // namespace

ModeFit fit_mode(const Eigen::Ref<const Eigen::RowVectorXd>& z, double max_stiffness) {
  if (!z.allFinite()) {
    throw Error(ErrorCode::kInvalidArgument, "z", "a motion has numbers that are not finite");
  }
  const Eigen::Index rows = z.size() - 2;
  const double size = z.size() > 0 ? z.cwiseAbs().maxCoeff() : 0;
  if (rows < 1 || size == 0) return {};
  const Eigen::RowVectorXd unit = z / size;
  const Eigen::RowVectorXd position = unit.segment(1, rows);
  Eigen::RowVectorXd velocity = unit.tail(rows) - position;
  const Eigen::RowVectorXd acceleration = velocity - (position - unit.head(rows));
  if (velocity.norm() <= kRounding * unit.norm()) velocity.setZero();

  // Both free: the part of the velocity that is independent of the position gives d.
  const double square = position.squaredNorm();
  if (square > 0) {
    Eigen::RowVectorXd apart = velocity;
    for (int pass = 0; pass < 2; ++pass) apart -= (apart.dot(position) / square) * position;
    if (apart.norm() > kProportional * velocity.norm() + kRounding * unit.norm()) {
      const double damping = -acceleration.dot(apart) / apart.squaredNorm();
      const double stiffness = -(acceleration + damping * velocity).dot(position) / square;
      if (stiffness >= 0 && stiffness <= max_stiffness && damping >= 0) return {stiffness, damping};
    }
  }
  // The problem is convex: otherwise the minimum has one of the two at a bound.
  const auto cost = [&](const ModeFit& fit) {
    return (acceleration + fit.damping * velocity + fit.stiffness * position).squaredNorm();
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

}  // namespace limber::spacetime
