#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cmath>
#include <functional>
#include <vector>

namespace limber::testing {

/// An energy as the one conformance suite sees it. Functions that are empty are not checked.
struct EnergyUnderTest {
  std::function<double(const Eigen::VectorXd&)> value;
  std::function<Eigen::VectorXd(const Eigen::VectorXd&)> gradient;
  std::function<Eigen::MatrixXd(const Eigen::VectorXd&)> hessian;
  /// States that must have zero energy and zero gradient.
  std::vector<Eigen::VectorXd> zero_states;
  /// Maps a state to another of equal energy (a rigid motion, say).
  std::vector<std::function<Eigen::VectorXd(const Eigen::VectorXd&)>> invariances;
};

struct ConformanceResult {
  double gradient_error = 0;    // relative by norm, against central differences of the value
  double hessian_error = 0;     // relative by norm, against central differences of the gradient
  double asymmetry = 0;         // |H - H^T| / |H|
  double zero_energy = 0;       // worst |E| and |g| at zero states, relative to those at the probe
  double invariance_error = 0;  // relative change of E
};

/// Differences with steps of about eps^(1/3) of the state's scale, along every coordinate.
inline ConformanceResult measure_conformance(const EnergyUnderTest& energy,
                                             const Eigen::VectorXd& x) {
  ConformanceResult result;
  const auto size = x.size();
  const double step = 6e-6 * std::max(1e-3, x.cwiseAbs().maxCoeff());
  Eigen::VectorXd difference(size);
  Eigen::MatrixXd hessian_difference;
  if (energy.hessian) hessian_difference.resize(size, size);
  const Eigen::VectorXd gradient = energy.gradient(x);
  Eigen::VectorXd probe = x;
  for (Eigen::Index i = 0; i < size; ++i) {
    probe[i] = x[i] + step;
    const double above = energy.value(probe);
    const Eigen::VectorXd gradient_above =
        energy.hessian ? energy.gradient(probe) : Eigen::VectorXd();
    probe[i] = x[i] - step;
    difference[i] = (above - energy.value(probe)) / (2 * step);
    if (energy.hessian)
      hessian_difference.col(i) = (gradient_above - energy.gradient(probe)) / (2 * step);
    probe[i] = x[i];
  }
  result.gradient_error = (gradient - difference).norm() / difference.norm();
  if (energy.hessian) {
    const Eigen::MatrixXd hessian = energy.hessian(x);
    result.hessian_error = (hessian - hessian_difference).norm() / hessian_difference.norm();
    result.asymmetry = (hessian - hessian.transpose()).norm() / hessian.norm();
  }
  const double scale = std::abs(energy.value(x));
  for (const auto& zero : energy.zero_states) {
    result.zero_energy = std::max({result.zero_energy, std::abs(energy.value(zero)) / scale,
                                   energy.gradient(zero).norm() / gradient.norm()});
  }
  for (const auto& map : energy.invariances) {
    result.invariance_error =
        std::max(result.invariance_error, std::abs(energy.value(map(x)) - energy.value(x)) / scale);
  }
  return result;
}

/// The one suite every energy passes. Tolerances: gradient 1e-7, Hessian 1e-6 (differences), the
/// rest 1e-10. Also checks that a deliberately wrong gradient is caught at this state.
inline void expect_conforms(const EnergyUnderTest& energy, const Eigen::VectorXd& x) {
  const ConformanceResult result = measure_conformance(energy, x);
  EXPECT_LT(result.gradient_error, 1e-7);
  EXPECT_LT(result.hessian_error, 1e-6);
  EXPECT_LT(result.asymmetry, 1e-12);
  EXPECT_LT(result.zero_energy, 1e-10);
  EXPECT_LT(result.invariance_error, 1e-10);
  EnergyUnderTest wrong = energy;
  wrong.gradient = [&energy](const Eigen::VectorXd& state) -> Eigen::VectorXd {
    Eigen::VectorXd gradient = energy.gradient(state);
    Eigen::Index largest = 0;
    gradient.cwiseAbs().maxCoeff(&largest);
    gradient[largest] *= 1.0001;
    return gradient;
  };
  EXPECT_GT(measure_conformance(wrong, x).gradient_error, 1e-7)
      << "a wrong gradient would pass unnoticed here";
}

}  // namespace limber::testing
