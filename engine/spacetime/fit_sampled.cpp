#include "engine/spacetime/fit_sampled.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>

#include "engine/spacetime/force_rows.h"

namespace limber::spacetime {
namespace {

/// Omega [1/frame] and the logarithm of zeta, of which forces are smooth functions.
using Point = Eigen::Vector2d;

constexpr int kFrequencies = 12;  // of the grid, each half of the one before
constexpr double kRatios[] = {FitOptions::kLeastDampingRatio, 0.03, 0.2, 0.7,
                              FitOptions::kGreatestDampingRatio};
constexpr int kSteps = 60;
constexpr double kDifference = 1e-6;  // of central differences, relative to omega

ModeFit fit_at(const Point& point) {
  return {point[0] * point[0], 2 * std::exp(point[1]) * point[0]};
}

/// Five numbers whose squares have the sum of those of all rows (ForceRows): three by the R of the
/// signals, two of what the mode begins with.
using Residual = Eigen::Matrix<double, 5, 1>;

/// Force of a mode as a function of its dynamics.
class SampledForce {
 public:
  SampledForce(const Eigen::MatrixX3d& signals, const Eigen::Vector2d& first,
               const FitOptions& options)
      : first_(first), smoothing_(options.smoothing) {
    if (options.beginning != Beginning::kFromRest) first_.setZero();
    const Eigen::HouseholderQR<Eigen::MatrixX3d> qr(signals);
    const Eigen::Index rows = std::min<Eigen::Index>(3, signals.rows());
    signals_.setZero();
    signals_.topRows(rows) =
        qr.matrixQR().topRows(rows).template triangularView<Eigen::Upper>().toDenseMatrix();
    const double most = std::min(options.max_stiffness, FitOptions::kGreatestSampledStiffness);
    low_ = {0, std::log(FitOptions::kLeastDampingRatio)};
    high_ = {std::sqrt(most), std::log(FitOptions::kGreatestDampingRatio)};
  }

  [[nodiscard]] Residual at(const Point& point) const {
    const ModeFit fit = fit_at(point);
    const ForceStencil stencil =
        force_stencil(Discretisation::kSampled, fit.stiffness, fit.damping);
    const BeginningCost begun = beginning_cost(fit.stiffness, fit.damping, smoothing_);
    Residual result;
    result << signals_ *
                  Eigen::Vector3d(stencil.before, stencil.next - stencil.before, fit.stiffness),
        begun.place * first_[0], begun.lag * first_[0] + begun.speed * first_[1];
    return result;
  }
  [[nodiscard]] double cost(const Point& point) const { return at(point).squaredNorm(); }
  [[nodiscard]] const Point& low() const { return low_; }
  [[nodiscard]] const Point& high() const { return high_; }
  [[nodiscard]] Point inside(const Point& point) const {
    return point.cwiseMax(low_).cwiseMin(high_);
  }
  [[nodiscard]] Point point_of(const ModeFit& fit) const {
    const double omega = std::sqrt(std::max(fit.stiffness, 0.0));
    const double ratio = omega > 0 ? fit.damping / (2 * omega) : 0.0;
    return inside({omega, std::log(std::max(ratio, FitOptions::kLeastDampingRatio))});
  }

  /// By differences that stay inside the bounds.
  [[nodiscard]] Eigen::Matrix<double, 5, 2> derivative(const Point& point) const {
    Eigen::Matrix<double, 5, 2> result;
    for (int i = 0; i < 2; ++i) {
      const double step = kDifference * (i == 0 ? std::max(point[0], kDifference) : 1);
      Point below = point, above = point;
      below[i] = std::max(low_[i], point[i] - step);
      above[i] = std::min(high_[i], point[i] + step);
      const double apart = above[i] - below[i];
      if (apart > 0) {
        result.col(i) = (at(above) - at(below)) / apart;
      } else {
        result.col(i).setZero();
      }
    }
    return result;
  }

  /// The best linear prediction: z_(i+1) = (2 + D - L) z_i / (1 + D) - z_(i-1) / (1 + D).
  [[nodiscard]] std::optional<Point> prediction() const;

 private:
  Eigen::Matrix3d signals_;
  Eigen::Vector2d first_;
  double smoothing_;
  Point low_, high_;
};

std::optional<Point> SampledForce::prediction() const {
  const Eigen::Vector2d rates =
      signals_.rightCols<2>().colPivHouseholderQr().solve(-signals_.col(0));
  const double kept = 1 / (1 + rates[0]), half = (1 + kept - rates[1] * kept) / 2;
  if (!(kept > 0) || !std::isfinite(half)) return std::nullopt;
  const std::complex<double> root = std::sqrt(std::complex<double>(half * half - kept, 0));
  const std::complex<double> one = half + root, other = half - root;
  if (one.imag() == 0 && !(std::min(one.real(), other.real()) > 0)) return std::nullopt;
  const std::complex<double> rate = -std::log(one), second = -std::log(other);
  return point_of({(rate * second).real(), (rate + second).real()});
}

/// Levenberg-Marquardt within the bounds.
Point descend(const SampledForce& force, Point point) {
  double damping = 1e-3, cost = force.cost(point);
  for (int step = 0; step < kSteps; ++step) {
    const Residual residual = force.at(point);
    Eigen::Matrix<double, 5, 2> by_point = force.derivative(point);
    const Eigen::Vector2d gradient = by_point.transpose() * residual;
    for (int i = 0; i < 2; ++i) {
      const bool is_held =
          gradient[i] > 0 ? point[i] <= force.low()[i] : point[i] >= force.high()[i];
      if (is_held) by_point.col(i).setZero();
    }
    Eigen::Matrix2d normal = by_point.transpose() * by_point;
    const Eigen::Vector2d wanted = by_point.transpose() * residual;
    for (int i = 0; i < 2; ++i)
      normal(i, i) = normal(i, i) > 0 ? normal(i, i) * (1 + damping) : 1.0;
    const double determinant = normal(0, 0) * normal(1, 1) - normal(0, 1) * normal(1, 0);
    if (!(determinant > 0)) break;
    const Point toward(normal(1, 1) * wanted[0] - normal(0, 1) * wanted[1],
                       normal(0, 0) * wanted[1] - normal(1, 0) * wanted[0]);
    const Point next = force.inside(point - toward / determinant);
    const double now = force.cost(next);
    if (now < cost) {
      const bool is_settled = cost - now <= 1e-15 * cost;
      point = next;
      cost = now;
      damping = std::max(damping / 10, 1e-14);
      if (is_settled) break;
    } else {
      damping *= 8;
      if (damping > 1e8) break;
    }
  }
  return point;
}

}  // namespace

ModeFit fit_sampled(const Eigen::MatrixX3d& signals, const Eigen::Vector2d& first,
                    const FitOptions& options) {
  const SampledForce force(signals, first, options);
  Point start(0, force.low()[1]);
  double least = force.cost(start);
  for (int i = 0; i < kFrequencies; ++i) {
    for (const double ratio : kRatios) {
      const Point point(std::ldexp(force.high()[0], -i), std::log(ratio));
      const double cost = force.cost(point);
      if (!(cost < least)) continue;
      least = cost;
      start = point;
    }
  }
  Point best = descend(force, start);
  const auto consider = [&](const Point& other) {
    const Point end = descend(force, other);
    if (force.cost(end) < force.cost(best)) best = end;
  };
  if (const std::optional<Point> predicted = force.prediction()) consider(*predicted);
  if (options.known) consider(force.point_of(*options.known));
  if (!(force.cost(best) < force.cost({0, force.low()[1]}))) return {};
  return fit_at(best);
}

}  // namespace limber::spacetime
