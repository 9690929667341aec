#include "tests/support/chain_kinematics.h"

#include <Eigen/Geometry>
#include <cmath>

namespace limber::testing {
namespace {

struct Coefficients {
  double a, b, c, d;  // sin t / t, (1 - cos t) / t^2 and their derivatives by t over t
};

Coefficients coefficients(double square) {
  if (square < 1e-3) {
    const double s = square;
    return {1 - s / 6 + s * s / 120 - s * s * s / 5040,
            0.5 - s / 24 + s * s / 720 - s * s * s / 40320,
            -1.0 / 3 + s / 30 - s * s / 840 + s * s * s / 45360,
            -1.0 / 12 + s / 180 - s * s / 6720 + s * s * s / 453600};
  }
  const double t = std::sqrt(square), a = std::sin(t) / t, b = (1 - std::cos(t)) / square;
  return {a, b, (std::cos(t) - a) / square, (a - 2 * b) / square};
}

/// exp([w]) e_x and its derivative by w: e + a w x e + b w x (w x e).
Eigen::Vector3d turned(const Eigen::Vector3d& w, Eigen::Matrix3d& derivative) {
  const Eigen::Vector3d e = Eigen::Vector3d::UnitX();
  const auto [a, b, c, d] = coefficients(w.squaredNorm());
  const Eigen::Vector3d we = w.cross(e), wwe = w.cross(we);
  Eigen::Matrix3d minus_cross_e;  // v -> v x e
  minus_cross_e << 0, e.z(), -e.y(), -e.z(), 0, e.x(), e.y(), -e.x(), 0;
  // w x (w x e) = w (w . e) - e (w . w)
  derivative =
      a * minus_cross_e +
      b * (w * e.transpose() + w.dot(e) * Eigen::Matrix3d::Identity() - 2 * e * w.transpose()) +
      (c * we + d * wwe) * w.transpose();
  return e + a * we + b * wwe;
}

}  // namespace

ChainKinematics::ChainKinematics(int coordinates, int links, double bend, double length,
                                 unsigned seed)
    : coordinates_(coordinates), links_(links), length_(length) {
  std::mt19937_64 generator(seed);
  rotation_.setZero(3 * links, coordinates);
  stretch_.setZero(links, coordinates);
  for (int k = 0; k < coordinates; ++k) {
    // Mode k bends with k / 3 + 1 half waves, the softer the lower, as columns of W-hat scaled by 1
    // / sqrt(lambda) are.
    const int waves = k / 3 + 1;
    const double size = bend / (waves * waves);
    const Eigen::Vector3d axis(uniform(generator), uniform(generator), uniform(generator));
    const double stretch = 0.3 * uniform(generator) / (waves * waves);
    for (int link = 0; link < links; ++link) {
      const double x = (link + 0.5) / links;
      rotation_.block<3, 1>(3 * link, k) =
          size * std::sin(1.5707963267948966 * (2 * waves - 1) * x) * axis;
      stretch_(link, k) = stretch * std::cos(1.5707963267948966 * (2 * waves - 1) * x);
    }
  }
}

void ChainKinematics::evaluate(std::span<const int> /*frames*/,
                               const Eigen::Ref<const Eigen::MatrixXd>& z,
                               std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                               Eigen::MatrixXd* jacobian) const {
  const auto count = static_cast<Eigen::Index>(queries.size());
  u.resize(3, count);
  if (jacobian != nullptr) jacobian->resize(3 * count, coordinates_);
  const double step = length_ / links_;
  Eigen::Matrix3d derivative;
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& query = queries[static_cast<std::size_t>(i)];
    const Eigen::VectorXd w = rotation_ * z.col(query.column);
    const Eigen::VectorXd s = stretch_ * z.col(query.column);
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();
    Eigen::MatrixXd row = Eigen::MatrixXd::Zero(3, coordinates_);
    for (int link = 0; link <= query.site; ++link) {
      const Eigen::Vector3d direction = turned(w.segment<3>(3 * link), derivative);
      const double size = step * (1 + s[link]);
      tip += size * direction - step * Eigen::Vector3d::UnitX();
      if (jacobian == nullptr) continue;
      row += size * derivative * rotation_.middleRows(3 * link, 3) +
             step * direction * stretch_.row(link);
    }
    u.col(i) = tip;
    if (jacobian != nullptr) jacobian->middleRows(3 * i, 3) = row;
  }
}

LinearKinematics::LinearKinematics(int coordinates, int sites, double length, unsigned seed)
    : length_(length) {
  std::mt19937_64 generator(seed);
  maps_.resize(3 * sites, coordinates);
  for (Eigen::Index k = 0; k < maps_.cols(); ++k) {
    for (Eigen::Index i = 0; i < maps_.rows(); ++i) {
      maps_(i, k) = length * uniform(generator) / (1 + static_cast<double>(k / 3));
    }
  }
}

LinearKinematics LinearKinematics::translation(double length) {
  LinearKinematics kinematics(length);
  kinematics.maps_ = length * Eigen::MatrixXd::Identity(3, 3);
  return kinematics;
}

void LinearKinematics::evaluate(std::span<const int> /*frames*/,
                                const Eigen::Ref<const Eigen::MatrixXd>& z,
                                std::span<const reduced::SiteQuery> queries, Eigen::Matrix3Xd& u,
                                Eigen::MatrixXd* jacobian) const {
  const auto count = static_cast<Eigen::Index>(queries.size());
  u.resize(3, count);
  if (jacobian != nullptr) jacobian->resize(3 * count, coordinate_count());
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& query = queries[static_cast<std::size_t>(i)];
    u.col(i) = maps_.middleRows(3 * query.site, 3) * z.col(query.column);
    if (jacobian != nullptr) jacobian->middleRows(3 * i, 3) = maps_.middleRows(3 * query.site, 3);
  }
}

}  // namespace limber::testing
