#include "engine/spacetime/recovery_step.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <utility>

namespace limber::spacetime {
namespace {

constexpr double kLeastDamping = 1e-9;
constexpr int kTrials = 16;           // dampings tried in one step
constexpr double kDependent = 1e-10;  // of columns of S
constexpr double kTiny = 1e-13;       // of a diagonal, keeps unknowns without effect still

/// Columns of length zero are no use to anything but E_s, whose gradient there is zero: they get
/// what is missing most, or any direction where nothing is missing.
void revive_columns(const RecoveryEnergy& energy, RecoveredMotion& at) {
  for (Eigen::Index k = 0; k < at.mixing.cols(); ++k) {
    if (at.mixing.col(k).squaredNorm() > 1e-200) continue;
    const Eigen::MatrixXd missing = energy.target() - at.mixing * at.z;
    Eigen::Index frame = 0;
    const double size = missing.colwise().norm().maxCoeff(&frame);
    at.mixing.col(k) = size > 0 ? Eigen::VectorXd(missing.col(frame) / size)
                                : Eigen::VectorXd::Unit(at.mixing.rows(), k);
    at.z.row(k).setZero();
    at.dynamics.stiffness[k] = at.dynamics.damping[k] = 0;
    energy.fit_motion(at);
  }
}

/// Orthonormal columns that span those of S.
Eigen::MatrixXd range_of(const Eigen::MatrixXd& mixing) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(mixing.rows(), mixing.cols());
  qr.setThreshold(kDependent);
  qr.compute(mixing);
  return qr.householderQ() * Eigen::MatrixXd::Identity(mixing.rows(), qr.rank());
}

/// Rows l * r + k: sum over frames i of z_ki times row l of G E_i, E_i the rows of frame i: the
/// cross terms' transpose times E without their dense form, r times cheaper.
Eigen::MatrixXd crossed(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& z,
                        const BandedCholesky::Columns& columns) {
  const Eigen::Index r = z.rows(), frames = z.cols(), width = columns.cols();
  BandedCholesky::Columns weighed(columns.rows(), width);
  for (Eigen::Index i = 0; i < frames; ++i)
    weighed.middleRows(i * r, r).noalias() = gram * columns.middleRows(i * r, r);
  using Strided = Eigen::Map<const BandedCholesky::Columns, 0, Eigen::OuterStride<>>;
  Eigen::MatrixXd result(r * r, width);
  for (Eigen::Index l = 0; l < r; ++l) {
    const Strided of_row(weighed.data() + l * width, frames, width,
                         Eigen::OuterStride<>(r * width));
    result.middleRows(l * r, r).noalias() = z * of_row;
  }
  return result;
}

}  // namespace

/// The Gauss-Newton model at a point. S moves by S C + P, P orthogonal to the columns of S: to
/// first order the residuals of P have nothing to do with those of z and C, so that only C is
/// coupled with z, which is eliminated.
struct RecoveryStep::Model {
  Model(const RecoveryEnergy& energy, const RecoveredMotion& at)
      : gram(at.mixing.transpose() * at.mixing), spread(at.z * at.z.transpose()) {
    const Eigen::Index r = at.z.rows(), frames = at.z.cols();
    const double weight = energy.weight();
    const Eigen::MatrixXd by_motion = energy.gradient_of_motion(at);
    const Eigen::MatrixXd by_mixing = energy.gradient_of_mixing(at);

    // Cross terms of z and C(l, k), which moves the constraints of frame i by S e_l z_ki; and the
    // gradient by z.
    BandedCholesky::Columns cross(r * frames, r * r + 1);
    for (Eigen::Index i = 0; i < frames; ++i) {
      for (Eigen::Index m = 0; m < r; ++m) {
        for (Eigen::Index l = 0; l < r; ++l) {
          cross.row(i * r + m).segment(l * r, r) = (weight * gram(m, l)) * at.z.col(i).transpose();
        }
        cross(i * r + m, r * r) = by_motion(m, i);
      }
    }
    eliminated = cross;
    energy.factor_motion(at).solve(eliminated);

    schur.resize(r * r, r * r);
    for (Eigen::Index l = 0; l < r; ++l) {
      for (Eigen::Index m = 0; m < r; ++m)
        schur.block(l * r, m * r, r, r) = (weight * gram(l, m)) * spread;
    }
    for (Eigen::Index k = 0; k < r; ++k) {
      for (Eigen::Index l = 0; l < r; ++l) {
        for (Eigen::Index m = 0; m < r; ++m)
          schur(l * r + k, m * r + k) += 8 * energy.column_weight() * gram(l, k) * gram(m, k);
      }
    }
    const Eigen::MatrixXd reduced = weight * crossed(gram, at.z, eliminated);
    schur -= reduced.leftCols(r * r);
    const BandedCholesky::Columns by_coupling = at.mixing.transpose() * by_mixing;  // l * r + k
    descent = reduced.col(r * r) - by_coupling.reshaped<Eigen::RowMajor>();

    const Eigen::MatrixXd range = range_of(at.mixing);
    outside = by_mixing - range * (range.transpose() * by_mixing);
  }

  /// @returns `at` moved by the step of this damping
  [[nodiscard]] RecoveredMotion moved(const RecoveredMotion& at, double weight,
                                      double damping) const {
    const Eigen::Index r = at.z.rows();
    Eigen::MatrixXd damped = schur;
    const double floor = kTiny * weight * gram.diagonal().maxCoeff() * spread.diagonal().maxCoeff();
    for (Eigen::Index l = 0; l < r; ++l) {
      for (Eigen::Index k = 0; k < r; ++k)
        damped(l * r + k, l * r + k) += damping * weight * gram(l, l) * spread(k, k) + floor;
    }
    const Eigen::VectorXd coupling = damped.ldlt().solve(descent);
    Eigen::MatrixXd normal = weight * spread;
    normal.diagonal() +=
        weight *
        (damping * spread.diagonal().array() + kTiny * spread.diagonal().maxCoeff()).matrix();
    RecoveredMotion result = at;
    const Eigen::VectorXd dz = -(eliminated.leftCols(r * r) * coupling + eliminated.col(r * r));
    result.z += dz.reshaped(r, at.z.cols());
    result.mixing += at.mixing * coupling.reshaped<Eigen::RowMajor>(r, r) -
                     normal.ldlt().solve(outside.transpose()).transpose();
    return result;
  }

  Eigen::MatrixXd gram, spread;  // S^T S, z z^T
  Eigen::MatrixXd schur;         // of C, row-major pairs (l, k)
  Eigen::VectorXd descent;
  BandedCholesky::Columns eliminated;  // by z: cross terms, gradient
  Eigen::MatrixXd outside;             // gradient by P
};

double RecoveryStep::take(RecoveredMotion& at) {
  const double before = energy_.value(at).total;
  revive_columns(energy_, at);
  const Model model(energy_, at);
  for (int trial = 0; trial < kTrials; ++trial) {
    RecoveredMotion candidate = model.moved(at, energy_.weight(), damping_);
    if (candidate.z.allFinite() && candidate.mixing.allFinite()) {
      energy_.fit_dynamics(candidate);
      energy_.balance(candidate);
      const double after = energy_.value(candidate).total;
      if (after < before) {
        at = std::move(candidate);
        damping_ = std::max(damping_ / 3, kLeastDamping);
        return before - after;
      }
    }
    damping_ *= 4;
  }
  return before - energy_.value(at).total;
}

}  // namespace limber::spacetime
