#pragma once

#include <vector>

namespace limber::bench::stability {

/// Tip of a cantilever of length one under a dead load across it.
struct ElasticaTip {
  double deflection = 0;  // w
  double along = 0;       // 1 - u
};

/// By elliptic integrals (no solver shares this code). @param alpha  P L^2 / EI, > 0
[[nodiscard]] ElasticaTip cantilever_tip(double alpha);

/// By Runge and Kutta's method and bisection: pieces of equal length from root to tip, each with
/// its own EI, under the load P. Exact to about 1e-12 for P L^2 / EI up to some 10.
[[nodiscard]] ElasticaTip uneven_cantilever_tip(const std::vector<double>& bending, double load);

/// Height over length of the elastica compressed to this span over length, in (-1, 1): between
/// hinges or between clamps, that is the same.
[[nodiscard]] double compressed_height(double span);

}  // namespace limber::bench::stability
