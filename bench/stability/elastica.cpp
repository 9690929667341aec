#include "bench/stability/elastica.h"

#include <array>
#include <cmath>
#include <numbers>

namespace limber::bench::stability {
namespace {

constexpr int kBisections = 200;
// Beyond, the tip's tangent is along the load up to rounding (exp(-2 sqrt(alpha))).
constexpr double kUpright = 300;
constexpr int kStepsOfPiece = 4000;

/// Ends at (x, z) for a guess of where the tip comes to be.
std::array<double, 2> shoot(const std::vector<double>& bending, double load, double tip) {
  double theta = 0, x = 0, z = 0;
  const double h = 1.0 / (kStepsOfPiece * static_cast<double>(bending.size()));
  for (const double ei : bending) {
    const auto rate = [&](double t, double at) {
      return std::array<double, 3>{load * (tip - at) / ei, std::cos(t), std::sin(t)};
    };
    for (int i = 0; i < kStepsOfPiece; ++i) {
      const auto a = rate(theta, x);
      const auto b = rate(theta + 0.5 * h * a[0], x + 0.5 * h * a[1]);
      const auto c = rate(theta + 0.5 * h * b[0], x + 0.5 * h * b[1]);
      const auto d = rate(theta + h * c[0], x + h * c[1]);
      theta += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0]);
      x += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1]);
      z += h / 6 * (a[2] + 2 * b[2] + 2 * c[2] + d[2]);
    }
  }
  return {x, z};
}

}  // namespace

ElasticaTip cantilever_tip(double alpha) {
  const double root = std::sqrt(alpha);
  // sin(theta of the tip) = 2 k^2 - 1; sqrt(alpha) = K(k) - F(phi, k) with sin(phi) = 1 / (k
  // sqrt 2).
  const auto phi_of = [](double k) { return std::asin(1 / (k * std::numbers::sqrt2)); };
  if (alpha >= kUpright)
    return {1 - 2 / root * (1 - 1 / std::numbers::sqrt2), std::numbers::sqrt2 / root};
  double low = 0, high = 1;  // sin(theta of the tip)
  for (int i = 0; i < kBisections; ++i) {
    const double sine = 0.5 * (low + high), k = std::sqrt(0.5 * (1 + sine));
    const double reached = k < 1 ? std::comp_ellint_1(k) - std::ellint_1(k, phi_of(k)) : 1e300;
    (reached < root ? low : high) = sine;
  }
  const double sine = low, k = std::sqrt(0.5 * (1 + sine));
  return {1 - 2 / root * (std::comp_ellint_2(k) - std::ellint_2(k, phi_of(k))),
          std::sqrt(2 * sine / alpha)};
}

ElasticaTip uneven_cantilever_tip(const std::vector<double>& bending, double load) {
  double low = 0, high = 1;
  for (int i = 0; i < kBisections && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) break;
    (shoot(bending, load, middle)[0] > middle ? low : high) = middle;
  }
  const auto end = shoot(bending, load, low);
  return {end[1], end[0]};
}

double compressed_height(double span) {
  double low = 0, high = 1;
  for (int i = 0; i < kBisections; ++i) {
    const double k = 0.5 * (low + high);
    const double reached = 2 * std::comp_ellint_2(k) / std::comp_ellint_1(k) - 1;
    (reached > span ? low : high) = k;
  }
  return low / std::comp_ellint_1(low);
}

}  // namespace limber::bench::stability
