#include "engine/spacetime/fit_dynamics.h"

#include <algorithm>
#include <array>
#include <limits>

#include "engine/base/error.h"

namespace limber::spacetime {
namespace {

/// Velocity counts as proportional to displacement where its independent part is no more than this
/// of it, or than differences of neighbouring frames lose to rounding.
constexpr double kProportional = 1e-10;
constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();

/// Best multiple x >= 0 of `column` in |acceleration + x column|^2.
double best_multiple(const Eigen::RowVectorXd& acceleration, const Eigen::RowVectorXd& column) {
  const double square = column.squaredNorm();
  return square > 0 ? std::max(0.0, -acceleration.dot(column) / square) : 0.0;
}

}  // namespace

ModeFit fit_mode(const Eigen::Ref<const Eigen::RowVectorXd>& z) {
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
      if (stiffness >= 0 && damping >= 0) return {stiffness, damping};
    }
  }
  // The problem is convex: otherwise the minimum has one of the two at its bound.
  const std::array<ModeFit, 2> candidates = {ModeFit{best_multiple(acceleration, position), 0},
                                             ModeFit{0, best_multiple(acceleration, velocity)}};
  const auto cost = [&](const ModeFit& fit) {
    return (acceleration + fit.damping * velocity + fit.stiffness * position).squaredNorm();
  };
  return cost(candidates[1]) < cost(candidates[0]) ? candidates[1] : candidates[0];
}

}  // namespace limber::spacetime
