#include "engine/spacetime/recovery_start.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <complex>
#include <numeric>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "engine/base/degrees.h"
#include "engine/base/numerics/dense.h"

namespace limber::spacetime {
namespace {

struct Spectrum {
  double energy = 0;
  double frequency = 0;  // of the strongest part [rad/frame]
};

/// The spectrum of one mode, without its mean.
Spectrum spectrum_of(const Eigen::RowVectorXd& z) {
  const auto frames = static_cast<std::size_t>(z.size());
  const double mean = z.mean();
  std::vector<double> values(frames);
  for (std::size_t i = 0; i < frames; ++i) values[i] = z[static_cast<Eigen::Index>(i)] - mean;
  Eigen::FFT<double> fft;
  std::vector<std::complex<double>> parts;
  fft.fwd(parts, values);
  Spectrum result;
  double strongest = 0;
  for (std::size_t p = 1; p <= frames / 2; ++p) {
    const double square = std::norm(parts[p]);
    result.energy += square;
    if (square <= strongest) continue;
    strongest = square;
    result.frequency = kFullTurn * static_cast<double>(p) / static_cast<double>(frames);
  }
  return result;
}

RecoveredMotion begin_recovery(const Eigen::MatrixXd& target, Eigen::MatrixXd mixing) {
  RecoveredMotion result;
  result.z = mixing.transpose() * target;
  result.dynamics = {Eigen::VectorXd::Zero(mixing.cols()), Eigen::VectorXd::Zero(mixing.cols())};
  result.mixing = std::move(mixing);
  return result;
}

}  // namespace

RecoveredMotion spectrum_start(const Eigen::MatrixXd& target, const Eigen::VectorXd& eigenvalues,
                               int modes) {
  RecoveredMotion result = begin_recovery(target, Eigen::MatrixXd::Identity(target.rows(), modes));
  // The most significant mode that can swing: rigid ones have no frequency to be scaled.
  Spectrum most;
  double eigenvalue = 0;
  for (int k = 0; k < modes; ++k) {
    const Spectrum spectrum = spectrum_of(target.row(k));
    if (eigenvalues[k] <= 0 || spectrum.energy <= most.energy) continue;
    most = spectrum;
    eigenvalue = eigenvalues[k];
  }
  if (eigenvalue > 0) {
    result.dynamics.stiffness =
        eigenvalues.head(modes) * (most.frequency * most.frequency / eigenvalue);
  }
  return result;
}

std::optional<CoupledOscillator> fit_oscillator(const Eigen::MatrixXd& z, Eigen::Index driven) {
  const Eigen::Index r = z.rows(), count = z.cols() - 2 - driven;
  if (count < 4 * r) return std::nullopt;
  const Eigen::MatrixXd before = z.middleCols(driven, count), now = z.middleCols(driven + 1, count),
                        after = z.middleCols(driven + 2, count);
  Eigen::MatrixXd known(2 * r, count);
  known << now, after - now;
  // Rows of their own size: a coordinate may be a millionth of another.
  const Eigen::VectorXd sizes = known.rowwise().norm().cwiseMax(1e-300);
  known = sizes.cwiseInverse().asDiagonal() * known;
  const Eigen::MatrixXd acceleration = after - 2 * now + before;
  Eigen::MatrixXd gram = known * known.transpose();
  constexpr double kRounding = 1e-13;
  gram.diagonal().array() += kRounding;
  const Eigen::MatrixXd rates = gram.ldlt().solve(known * acceleration.transpose()).transpose();
  if (!rates.allFinite()) return std::nullopt;
  CoupledOscillator found;
  found.force = 0.5 * (acceleration - rates * known).squaredNorm();
  const Eigen::MatrixXd unscaled = -rates * sizes.cwiseInverse().asDiagonal();
  found.stiffness = unscaled.leftCols(r);
  found.damping = unscaled.rightCols(r);
  return found;
}

std::optional<RecoveredMotion> separated_start(const Eigen::MatrixXd& target, int modes,
                                               Eigen::Index driven) {
  RecoveredMotion result = principal_start(target, modes);
  const auto oscillator = fit_oscillator(result.z, driven);
  if (!oscillator) return std::nullopt;
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(oscillator->stiffness);
  if (eigen.info() != Eigen::Success) return std::nullopt;
  Eigen::MatrixXd basis(modes, modes);
  for (Eigen::Index k = 0; k < modes; ++k) {
    // A complex pair gives its plane.
    const bool is_second = k > 0 && eigen.eigenvalues()[k].imag() < 0;
    if (is_second) {
      basis.col(k) = eigen.eigenvectors().col(k).imag();
    } else {
      basis.col(k) = eigen.eigenvectors().col(k).real();
    }
  }
  basis.colwise().normalize();
  constexpr double kLeastCondition = 1e-8;
  const Eigen::PartialPivLU<Eigen::MatrixXd> factor(basis);
  if (!basis.allFinite() || !(factor.rcond() > kLeastCondition)) return std::nullopt;
  const Eigen::MatrixXd z = factor.solve(result.z);
  // Those that move most come first, as of principal components.
  std::vector<Eigen::Index> order(static_cast<std::size_t>(modes));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) {
    return z.row(a).squaredNorm() > z.row(b).squaredNorm();
  });
  result.z = z(order, Eigen::all);
  result.mixing = result.mixing * basis(Eigen::all, order);
  return result;
}

RecoveredMotion principal_start(const Eigen::MatrixXd& target, int modes) {
  const SymmetricEigen eigen(target * target.transpose());
  return begin_recovery(target, eigen.eigenvectors().rowwise().reverse().leftCols(modes));
}

}  // namespace limber::spacetime
