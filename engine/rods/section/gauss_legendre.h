#pragma once

#include <vector>

namespace limber::rods {

/// Quadrature on [0, 1], exact for polynomials of degree 2 n - 1.
struct GaussLegendre {
  std::vector<double> points;
  std::vector<double> weights;
};
[[nodiscard]] GaussLegendre gauss_legendre(int n);

}  // namespace limber::rods
