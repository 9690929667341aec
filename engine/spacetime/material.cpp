#include "engine/spacetime/material.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace limber::spacetime {
namespace {

double mode_force_energy(double stiffness, double damping,
                         const Eigen::Ref<const Eigen::RowVectorXd>& z) {
  const Eigen::Index inner = z.size() - 2;
  if (inner < 1) return 0;
  return 0.5 * (z.head(inner) + (stiffness - damping - 2) * z.segment(1, inner) +
                (1 + damping) * z.tail(inner))
                   .squaredNorm();
}

}  // namespace

Eigen::MatrixXd first_coordinates(int coordinates, int modes) {
  return Eigen::MatrixXd::Identity(coordinates, modes);
}

bool are_first_coordinates(const Eigen::MatrixXd& mixing) { return mixing.isIdentity(0); }

double column_energy(const Eigen::Ref<const Eigen::MatrixXd>& mixing) {
  return (mixing.colwise().squaredNorm().array() - 1).square().sum();
}

Eigen::MatrixXd column_gradient(const Eigen::Ref<const Eigen::MatrixXd>& mixing) {
  const Eigen::RowVectorXd excess = 4 * (mixing.colwise().squaredNorm().array() - 1).matrix();
  return mixing * excess.asDiagonal();
}

double force_energy(const ModeDynamics& dynamics, const Eigen::Ref<const Eigen::MatrixXd>& motion) {
  double sum = 0;
  for (Eigen::Index k = 0; k < motion.rows(); ++k) {
    sum += mode_force_energy(dynamics.stiffness[k], dynamics.damping[k], motion.row(k));
  }
  return sum;
}

double unit_force_energy(const Material& material,
                         const Eigen::Ref<const Eigen::MatrixXd>& motion) {
  double sum = 0;
  for (Eigen::Index k = 0; k < motion.rows(); ++k) {
    sum += material.mixing.col(k).squaredNorm() * mode_force_energy(material.dynamics.stiffness[k],
                                                                    material.dynamics.damping[k],
                                                                    motion.row(k));
  }
  return sum;
}

double frequency_of(double stiffness) {
  return std::asin(std::sqrt(std::clamp(stiffness / 4, 0.0, 1.0))) / std::numbers::pi;
}

double stiffness_of(double frequency) {
  const double sine = std::sin(std::numbers::pi * frequency);
  return 4 * sine * sine;
}

ModeResponse mode_response(double stiffness, double damping, double frames_per_second) {
  // A mode is two rates s, x = exp(s / fps): decay -Re s, frequency |s|.
  const double half = (2 + damping - stiffness) / (2 * (1 + damping));
  const std::complex<double> root =
      std::sqrt(std::complex<double>(half * half - 1 / (1 + damping), 0));
  const std::complex<double> one = std::log(half + root), other = std::log(half - root);
  const double product = std::abs(one) * std::abs(other);
  ModeResponse response;
  const double slower = -std::max(one.real(), other.real());
  response.decay_per_s = slower > 0 ? slower * frames_per_second : 0;
  if (!(product > 0)) {
    // lambda = 0: one part never comes back, what is damped is only its speed.
    return response;
  }
  const double natural = std::sqrt(product);
  response.frequency_hz = std::min(0.5, natural / (2 * std::numbers::pi)) * frames_per_second;
  response.damping_ratio = std::max(0.0, -(one + other).real() / (2 * natural));
  return response;
}

}  // namespace limber::spacetime
