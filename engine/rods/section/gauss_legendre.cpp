#include "engine/rods/section/gauss_legendre.h"

#include <cmath>
#include <numbers>

namespace limber::rods {

GaussLegendre gauss_legendre(int n) {
  GaussLegendre result;
  for (int i = 0; i < n; ++i) {
    // Newton's method on P_n from an asymptotic guess.
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int step = 0; step < 20; ++step) {
      double p = x, before = 1;
      for (int k = 2; k <= n; ++k) {
        const double after = ((2 * k - 1) * x * p - (k - 1) * before) / k;
        before = p;
        p = after;
      }
      if (n == 1) before = 1;
      slope = n * (x * p - before) / (x * x - 1);
      const double change = p / slope;
      x -= change;
      if (std::abs(change) < 1e-16) break;
    }
    result.points.push_back(0.5 * (1 - x));
    result.weights.push_back(1 / ((1 - x * x) * slope * slope));
  }
  return result;
}

}  // namespace limber::rods
