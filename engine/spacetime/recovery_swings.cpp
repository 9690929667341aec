#include "engine/spacetime/recovery_swings.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>
#include <string>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/base/numerics/dense.h"
#include "engine/spacetime/force_rows.h"

namespace limber::spacetime {
namespace {

using Pole = std::complex<double>;  // z_i = Re(c pole^i)

constexpr Eigen::Index kMaxPoles = 8, kFramesPerPole = 6, kMaxLags = 32;
/// Share of a motion: a mode that swings by itself leaves at most this residual.
constexpr double kMaxSingleResidual = 0.2;
/// If a swing leaves more, the given dynamics are no worse.
constexpr double kMaxSwingResidual = 0.5;
/// A swing may leave this much more than the one nearest to the motion, which takes in some of
/// what other frequencies do.
constexpr double kMaxExcess = 2;
/// Several swings explain a motion if their residual is below this share of one swing's residual.
constexpr double kFarBetter = 0.5;
constexpr double kVisible = 0.1;          // of the displacements
constexpr double kRankTolerance = 1e-12;  // of squared singular values

/// Signal poles of a motion, largest subspace of `count` dimensions.
class Poles {
 public:
  explicit Poles(const Eigen::RowVectorXd& motion) {
    const Eigen::Index frames = motion.size();
    lags_ = std::min(kMaxLags, frames / 3);
    const Eigen::Index stride =
        std::max<Eigen::Index>(1, frames / (2 * std::max(lags_, Eigen::Index{1})));
    const Eigen::Index count = frames - 1 - stride * (lags_ - 1);
    Eigen::MatrixXd lagged(2 * lags_, count);
    for (Eigen::Index l = 0; l < lags_; ++l) {
      lagged.row(l) = motion.segment(l * stride, count);
      lagged.row(lags_ + l) = motion.segment(l * stride + 1, count);
    }
    const SymmetricEigen eigen(lagged * lagged.transpose());
    squares_ = eigen.eigenvalues().reverse();
    subspace_ = eigen.eigenvectors().rowwise().reverse();
  }

  /// Growing poles count as steady ones. Each complex pair is given by its upper pole.
  /// @returns nothing where the motion has fewer
  [[nodiscard]] std::vector<Pole> of(Eigen::Index count) const {
    if (count > lags_ || !(squares_[count - 1] > kRankTolerance * squares_[0])) return {};
    const Eigen::MatrixXd now = subspace_.topLeftCorner(lags_, count),
                          next = subspace_.bottomLeftCorner(lags_, count);
    const Eigen::EigenSolver<Eigen::MatrixXd> eigen(
        Eigen::MatrixXd(now.colPivHouseholderQr().solve(next)), false);
    if (eigen.info() != Eigen::Success) return {};
    std::vector<Pole> result;
    for (const Pole& pole : eigen.eigenvalues()) {
      if (pole.imag() < 0) continue;
      result.push_back(std::abs(pole) > 1 ? pole / std::abs(pole) : pole);
    }
    return result;
  }

 private:
  Eigen::Index lags_ = 0;
  Eigen::VectorXd squares_;
  Eigen::MatrixXd subspace_;
};

/// For differences (1 + d) x^2 - (2 + d - lambda) x + 1 = 0; for sampled modes x = e^(-s), lambda =
/// |s|^2, d = 2 Re s.
ModeFit dynamics_of(const Pole& pole, Discretisation discretisation) {
  if (discretisation == Discretisation::kSampled) {
    const Pole rate = -std::log(pole);
    return {std::norm(rate), 2 * std::max(rate.real(), 0.0)};
  }
  const double square = std::norm(pole);
  if (square >= 1) return {std::norm(1.0 - pole), 0};
  return {std::norm(1.0 - pole) / square, 1 / square - 1};
}

struct Fit {
  Pole main;                    // of the largest part
  Eigen::RowVectorXd largest;   // that part
  double residual = 1;          // of it alone
  double several_residual = 1;  // of all parts
};

Fit fit_parts(const Eigen::RowVectorXd& motion, const std::vector<Pole>& poles) {
  const Eigen::Index frames = motion.size();
  Eigen::MatrixXd parts(frames, 2 * static_cast<Eigen::Index>(poles.size()));
  for (std::size_t k = 0; k < poles.size(); ++k) {
    Pole power = 1;
    for (Eigen::Index i = 0; i < frames; ++i, power *= poles[k]) {
      parts(i, static_cast<Eigen::Index>(2 * k)) = power.real();
      parts(i, static_cast<Eigen::Index>(2 * k + 1)) = power.imag();
    }
  }
  const Eigen::VectorXd weights = parts.colPivHouseholderQr().solve(motion.transpose());
  const double size = motion.norm();
  Fit result;
  result.several_residual = (parts * weights - motion.transpose()).norm() / size;
  double most = -1;
  for (std::size_t k = 0; k < poles.size(); ++k) {
    const auto first = static_cast<Eigen::Index>(2 * k);
    const Eigen::RowVectorXd part =
        (parts.middleCols(first, 2) * weights.segment(first, 2)).transpose();
    if (part.norm() <= most) continue;
    most = part.norm();
    result.main = poles[k];
    result.largest = part;
  }
  result.residual = (motion - result.largest).norm() / size;
  return result;
}

bool is_oscillating(const Pole& pole, Eigen::Index frames) {
  return std::arg(pole) * static_cast<double>(frames) >= kFullTurn &&
         std::arg(pole) < kFullTurn / 2;
}

/// The nearest free motion of given dynamics.
Fit fit_given(const Eigen::RowVectorXd& motion, const ModeFit& given,
              Discretisation discretisation) {
  const ForceStencil stencil = force_stencil(discretisation, given.stiffness, given.damping);
  const double half = -0.5 * stencil.centre / stencil.next,
               rest = stencil.before / stencil.next - half * half;
  if (rest > 0) return fit_parts(motion, {Pole(half, std::sqrt(rest))});
  // Without a swing: from any two frames.
  const ModeDynamics dynamics{Eigen::VectorXd::Constant(2, given.stiffness),
                              Eigen::VectorXd::Constant(2, given.damping), discretisation, 0};
  const RecoveredMotion begun{Eigen::MatrixXd::Identity(2, 2), {}, dynamics};
  Eigen::MatrixXd parts(motion.size(), 2);
  parts << begun.z.transpose(),
      continue_freely(begun, static_cast<int>(motion.size() - 2)).z.transpose();
  Fit result;
  result.largest = (parts * parts.colPivHouseholderQr().solve(motion.transpose())).transpose();
  result.residual = result.several_residual = (motion - result.largest).norm() / motion.norm();
  return result;
}

Eigen::VectorXd displacement_weights(const Eigen::VectorXd& eigenvalues) {
  if (eigenvalues.minCoeff() <= 0) return Eigen::VectorXd::Ones(eigenvalues.size());
  return (eigenvalues[0] / eigenvalues.array()).sqrt();
}

}  // namespace

ModeSwing fit_swing(const Eigen::RowVectorXd& motion, const ModeFit& given,
                    Discretisation discretisation) {
  ModeSwing result{given, motion, 0, 0};
  const Eigen::Index frames = motion.size();
  if (frames < 3 || motion.isZero(0)) return result;
  const Fit of_given = fit_given(motion, given, discretisation);
  Fit chosen = of_given;
  ModeFit dynamics = given;
  bool is_found = is_oscillating(chosen.main, frames);
  const Poles poles(motion / motion.cwiseAbs().maxCoeff());
  double single = chosen.residual, several = chosen.several_residual;
  for (Eigen::Index count = 2; count <= std::min(kMaxPoles, frames / kFramesPerPole); count += 2) {
    const std::vector<Pole> found = poles.of(count);
    if (found.empty()) break;
    Fit fit = fit_parts(motion, found);
    several = std::min(several, fit.several_residual);
    if (!is_oscillating(fit.main, frames)) continue;
    if (count == 2) single = std::min(single, fit.residual);
    const bool is_better =
        count == 2
            ? fit.residual <= chosen.residual
            : fit.residual <= std::min(kMaxExcess * single, std::max(single, kMaxSingleResidual));
    if (!is_better) continue;
    dynamics = dynamics_of(fit.main, discretisation);
    chosen = std::move(fit);
    is_found = true;
  }
  result.residual = std::min(chosen.residual, 1.0);
  result.several_residual = std::min(several, result.residual);
  if (is_found && chosen.residual <= kMaxSwingResidual) {
    result.dynamics = dynamics;
    result.z = chosen.largest;
    return result;
  }
  // Fitted to its last swing, or to all if it then moves less: what free motion does not explain
  // may as well go against the continuation as with it.
  const double swing =
      1 / std::max(frequency_of(given.stiffness, discretisation), 1 / static_cast<double>(frames));
  const Eigen::Index last = std::min(frames, std::max<Eigen::Index>(3, std::llround(swing)));
  const Eigen::RowVectorXd of_all = of_given.largest.tail(last);
  const Eigen::RowVectorXd of_last = fit_given(motion.tail(last), given, discretisation).largest;
  result.z.tail(last) = of_all.norm() < of_last.norm() ? of_all : of_last;
  return result;
}

std::vector<ModeSwing> fit_swings(const RecoveredMotion& motion, Eigen::Index driven) {
  std::vector<ModeSwing> result;
  for (Eigen::Index k = 0; k < motion.z.rows(); ++k) {
    result.push_back(fit_swing(motion.z.row(k).tail(motion.z.cols() - driven),
                               {motion.dynamics.stiffness[k], motion.dynamics.damping[k]},
                               motion.dynamics.discretisation));
  }
  return result;
}

RecoveredMotion swinging(const RecoveredMotion& motion, const std::vector<ModeSwing>& swings) {
  RecoveredMotion result = motion;
  for (std::size_t k = 0; k < swings.size(); ++k) {
    const auto mode = static_cast<Eigen::Index>(k);
    result.z.row(mode).tail(swings[k].z.size()) = swings[k].z;
    result.dynamics.stiffness[mode] = swings[k].dynamics.stiffness;
    result.dynamics.damping[mode] = swings[k].dynamics.damping;
  }
  return result;
}

double share_not_free(const RecoveredMotion& motion, const std::vector<ModeSwing>& swings,
                      const Eigen::VectorXd& eigenvalues) {
  const Eigen::MatrixXd mixing = displacement_weights(eigenvalues).asDiagonal() * motion.mixing;
  double rest = 0;
  for (Eigen::Index k = 0; k < motion.z.rows(); ++k) {
    const double size = mixing.col(k).norm() * motion.z.row(k).norm();
    rest += std::pow(size * swings[static_cast<std::size_t>(k)].residual, 2);
  }
  const double size = (mixing * motion.z).norm();
  return size > 0 ? std::sqrt(rest) / size : 0;
}

std::string describe_several_frequencies(const RecoveredMotion& motion,
                                         const std::vector<ModeSwing>& swings,
                                         const Eigen::VectorXd& eigenvalues) {
  const Eigen::MatrixXd mixing = displacement_weights(eigenvalues).asDiagonal() * motion.mixing;
  const double size = (mixing * motion.z).norm();
  Eigen::Index worst = -1;
  for (Eigen::Index k = 0; k < motion.z.rows(); ++k) {
    const ModeSwing& swing = swings[static_cast<std::size_t>(k)];
    const bool is_visible = mixing.col(k).norm() * motion.z.row(k).norm() >= kVisible * size;
    const bool is_several = swing.residual > kMaxSingleResidual &&
                            swing.several_residual <= kFarBetter * swing.residual;
    if (!is_visible || !is_several) continue;
    if (worst < 0 || swing.residual > swings[static_cast<std::size_t>(worst)].residual) worst = k;
  }
  if (worst < 0) return {};
  const ModeSwing& swing = swings[static_cast<std::size_t>(worst)];
  return fmt::format(
      "the modes were not separated: a single frequency leaves {:.0f} % of the motion of mode {}, "
      "several frequencies leave {:.0f} %. Do not rely on its frequency and on the continuation: "
      "recover from more frames, or from another start",
      100 * swing.residual, worst + 1, 100 * swing.several_residual);
}

}  // namespace limber::spacetime
