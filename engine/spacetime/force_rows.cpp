#include "engine/spacetime/force_rows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/error.h"

namespace limber::spacetime {
namespace {

/// Damping of modes beyond the Nyquist frequency (ForceStencil).
constexpr double kAliasedDamping = 0.1;
/// Beyond it, forces of any motion that fits into memory are one constant.
constexpr double kLongestSmoothing = 1e6;

/// s / (1 - e^(-s)).
double static_gain(double rate) { return rate > 0 ? -rate / std::expm1(-rate) : 1.0; }

ForceStencil sampled_stencil(double stiffness, double damping) {
  const double decay = damping / 2, swing2 = stiffness - decay * decay;
  if (swing2 <= 0) {
    // Two rates with the sum d and the product lambda; their difference would cancel.
    const double faster = decay + std::sqrt(-swing2);
    const double slower = faster > 0 ? stiffness / faster : 0.0;
    const double gain = static_gain(faster) * static_gain(slower);
    return {gain * std::exp(-damping), -gain * (std::exp(-faster) + std::exp(-slower)), gain};
  }
  const double swing = std::sqrt(swing2);
  const double seen = std::max(decay, kAliasedDamping * (swing - std::numbers::pi));
  const double ratio = std::exp(-seen), lost = std::expm1(-seen), sine = std::sin(swing / 2);
  const double of_constant = lost * lost + 4 * ratio * sine * sine;
  const double gain = of_constant > 0 ? stiffness / of_constant : 1.0;
  return {gain * ratio * ratio, -2 * gain * ratio * std::cos(swing), gain};
}

}  // namespace

bool is_discretisation(Discretisation value) {
  return value == Discretisation::kDifferences || value == Discretisation::kSampled;
}

bool are_force_weights(const ModeDynamics& dynamics) {
  const Eigen::VectorXd& shares = dynamics.shares;
  const bool is_scale = dynamics.scale > 0 && std::isfinite(dynamics.scale);
  return is_scale && (shares.size() == 0 || shares.size() == dynamics.stiffness.size()) &&
         shares.allFinite() && (shares.array() > 0).all();
}

bool is_smoothing(double tau) { return tau >= 0 && tau <= kLongestSmoothing; }

ForceStencil force_stencil(Discretisation discretisation, double stiffness, double damping) {
  switch (discretisation) {
    case Discretisation::kDifferences:
      return {1, -2 - damping + stiffness, 1 + damping};
    case Discretisation::kSampled:
      return sampled_stencil(stiffness, damping);
  }
  LIMBER_DEMAND(false);
  return {};
}

FreeGrowth free_growth(const ForceStencil& stencil) {
  // Roots of next x^2 + centre x + before = 0; their product is before / next.
  const double b = stencil.centre, c = stencil.next;
  const double discriminant = b * b - 4 * c * stencil.before;
  constexpr double kLeast = 1e-300;  // solutions that are gone within a frame
  const double log_product = std::log(std::max(stencil.before / c, kLeast));
  FreeGrowth growth{log_product / 2, 0};
  if (discriminant > 0) growth.larger = std::log((std::abs(b) + std::sqrt(discriminant)) / (2 * c));
  growth.smaller = log_product - growth.larger;
  return growth;
}

ForceSmoothing::ForceSmoothing(double tau) {
  const double root = std::sqrt(1 + 4 * tau * tau);
  own = (1 + root) / 2;
  following = -2 * tau * tau / (1 + root);
}

Eigen::RowVectorXd smoothed_forces(const Eigen::RowVectorXd& forces, double tau) {
  const ForceSmoothing smoothing(tau);
  Eigen::RowVectorXd rows = Eigen::RowVectorXd::Zero(forces.size() + 1);
  rows.head(forces.size()) = smoothing.following * forces;
  rows.tail(forces.size()) += smoothing.own * forces;
  return rows;
}

Eigen::RowVectorXd smoothed_cycle(const Eigen::RowVectorXd& forces, double tau) {
  Eigen::RowVectorXd rows = smoothed_forces(forces, tau);
  rows[0] += rows[forces.size()];
  return rows.head(forces.size());
}

BeginningCost beginning_cost(double stiffness, double damping, double tau) {
  const ForceStencil stencil = sampled_stencil(stiffness, damping);
  const double gain = stencil.next, kept = stencil.before / gain, sum = -stencil.centre / gain;
  // 1 + kept - sum and 1 + kept + sum, the first without cancellation.
  const double constant = stiffness / gain, alternating = std::max(0.0, 1 + kept + sum);
  const double lost = (1 + tau * tau * constant) * std::max(0.0, 1 - kept);
  BeginningCost cost;
  cost.place = gain * std::sqrt(lost * constant * alternating / (1 + kept));
  cost.speed = gain * std::sqrt(lost * (1 + kept));
  cost.lag = -cost.speed * sum / (1 + kept);
  return cost;
}

ForceRows::ForceRows(const ModeDynamics& dynamics, int frame_count, Beginning beginning)
    : beginning_of_motion_(beginning == Beginning::kFromRest &&
                                   dynamics.discretisation == Discretisation::kDifferences
                               ? Beginning::kAnyhow
                               : beginning),
      reach_(dynamics.smoothing > 0 ? 3 : 2) {
  if (is_cyclic()) {
    first_ = 0;
    last_ = frame_count - 1;
  } else {
    first_ = begins_from_rest() ? -reach_ : 2 - reach_;
    last_ = frame_count - 3;
  }
  const Eigen::Index modes = dynamics.stiffness.size();
  const int lanes = padded_lanes(static_cast<int>(modes));
  rest_ = Eigen::VectorXd::Zero(lanes);
  stencil_.resize(lanes, 3);
  beginning_ = Lanes::Zero(lanes, 3);
  for (Eigen::Index k = 0; k < lanes; ++k) {
    const double root = std::sqrt(k < modes ? dynamics.force_weight(k) : dynamics.scale);
    const ForceStencil of_mode = k < modes ? force_stencil(dynamics, k) : ForceStencil{1, -1, 1};
    stencil_.row(k) << root * of_mode.before, root * of_mode.centre, root * of_mode.next;
    if (!begins_from_rest() || k >= modes) continue;
    const BeginningCost cost =
        beginning_cost(dynamics.stiffness[k], dynamics.damping[k], dynamics.smoothing);
    beginning_.row(k) << root * cost.place, root * cost.lag, root * cost.speed;
  }
  if (reach_ == 2) {
    inner_ = stencil_;
    return;
  }
  const ForceSmoothing smoothing(dynamics.smoothing);
  opening_ = closing_ = Lanes::Zero(lanes, 4);
  opening_.rightCols(3) = smoothing.following * stencil_;
  closing_.leftCols(3) = smoothing.own * stencil_;
  inner_ = opening_ + closing_;
}

const double* ForceRows::coefficient(int row, int term) const {
  if (is_cyclic()) return inner_.col(term).data();
  if (!contains(row)) return rest_.data();
  if (row < 2 - reach_) return beginning(row, term);
  if (reach_ == 2) return inner_.col(term).data();
  const Lanes& rows = row < 0 ? opening_ : row == last_ ? closing_ : inner_;
  return rows.col(term).data();
}

/// The first row has frame 0 alone, the second frames 0 and 1: none reaches behind its last term.
const double* ForceRows::beginning(int row, int term) const {
  const int frame = row + term;
  if (row == first_) return frame == 0 ? beginning_.col(0).data() : rest_.data();
  return frame == 0 || frame == 1 ? beginning_.col(1 + frame).data() : rest_.data();
}

FreeGrowth ForceRows::growth(int lane) const {
  return free_growth({stencil_(lane, 0), stencil_(lane, 1), stencil_(lane, 2)});
}

}  // namespace limber::spacetime
