#pragma once

namespace limber {

/// Armijo's rule: a step t along d is accepted where f(x + t d) <= f(x) + kArmijoShare t f'(x) d.
/// Dimensionless share of the decrease that the slope promises. Not tuned: the usual value (Nocedal
/// and Wright, Numerical Optimization, sec. 3.1), small enough to accept nearly every decrease.
inline constexpr double kArmijoShare = 1e-4;

}  // namespace limber
