#include "engine/spacetime/material.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "engine/spacetime/force_rows.h"

namespace limber::spacetime {
namespace {

/// Of each mode. Frame by frame: a row of a long motion would fetch all of it from memory.
Eigen::ArrayXd mode_force_energies(const ModeDynamics& dynamics,
                                   const Eigen::Ref<const Eigen::MatrixXd>& z,
                                   Beginning beginning) {
  Eigen::ArrayXd sums = Eigen::ArrayXd::Zero(z.rows());
  if (z.cols() < 3) return sums;
  const ForceRows rows(dynamics, static_cast<int>(z.cols()), beginning);
  Eigen::ArrayXd force(z.rows());
  for (int row = rows.first(); row <= rows.last(); ++row) {
    force.setZero();
    for (int term = 0; term <= rows.reach(); ++term) {
      Eigen::Index frame = row + term;
      if (rows.is_cyclic()) frame %= z.cols();
      if (frame < 0 || frame >= z.cols()) continue;
      force += Eigen::Map<const Eigen::ArrayXd>(rows.coefficient(row, term), z.rows()) *
               z.col(frame).array();
    }
    sums += force.square();
  }
  return 0.5 * sums;
}

/// Rates s of the free solutions exp(-s t) of a sampled mode.
struct SampledRates {
  double decay = 0, natural = 0;  // of the slower part; |s|, [1/frame]
};

SampledRates sampled_rates(double stiffness, double damping) {
  const double half = damping / 2, swing2 = stiffness - half * half;
  if (swing2 > 0) return {half, std::sqrt(stiffness)};
  const double faster = half + std::sqrt(-swing2);
  return {faster > 0 ? stiffness / faster : 0.0, std::sqrt(stiffness)};
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

double force_energy(const ModeDynamics& dynamics, const Eigen::Ref<const Eigen::MatrixXd>& motion,
                    Beginning beginning) {
  return mode_force_energies(dynamics, motion, beginning).sum();
}

double unit_force_energy(const Material& material, const Eigen::Ref<const Eigen::MatrixXd>& motion,
                         Beginning beginning) {
  const auto lengths = material.mixing.leftCols(motion.rows()).colwise().squaredNorm();
  return lengths * mode_force_energies(material.dynamics, motion, beginning).matrix();
}

double frequency_of(double stiffness, Discretisation discretisation) {
  if (discretisation == Discretisation::kSampled)
    return std::sqrt(std::max(stiffness, 0.0)) / (2 * std::numbers::pi);
  return std::asin(std::sqrt(std::clamp(stiffness / 4, 0.0, 1.0))) / std::numbers::pi;
}

double stiffness_of(double frequency, Discretisation discretisation) {
  if (discretisation == Discretisation::kSampled) {
    const double angle = 2 * std::numbers::pi * frequency;
    return angle * angle;
  }
  const double sine = std::sin(std::numbers::pi * frequency);
  return 4 * sine * sine;
}

ModeResponse mode_response(double stiffness, double damping, double frames_per_second,
                           Discretisation discretisation) {
  if (discretisation == Discretisation::kSampled) {
    const SampledRates rates = sampled_rates(stiffness, damping);
    return {rates.natural / (2 * std::numbers::pi) * frames_per_second,
            rates.natural > 0 ? damping / (2 * rates.natural) : 0.0,
            rates.decay * frames_per_second};
  }
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
    // lambda = 0: one part never comes back, only its speed is damped.
    return response;
  }
  const double natural = std::sqrt(product);
  response.frequency_hz = std::min(0.5, natural / (2 * std::numbers::pi)) * frames_per_second;
  response.damping_ratio = std::max(0.0, -(one + other).real() / (2 * natural));
  return response;
}

}  // namespace limber::spacetime
