#include "engine/spacetime/recovery_start.h"

#include <complex>
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

/// Of one mode, without its mean.
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

RecoveredMotion principal_start(const Eigen::MatrixXd& target, int modes) {
  const SymmetricEigen eigen(target * target.transpose());
  return begin_recovery(target, eigen.eigenvectors().rowwise().reverse().leftCols(modes));
}

}  // namespace limber::spacetime
