#include "engine/spacetime/recovery_step.h"

#include <Eigen/Cholesky>
#include <optional>
#include <utility>

#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"

namespace limber::spacetime {
namespace {

constexpr double kLeastRecoveredDamping = 1e-9;  // lower bound of Levenberg's nu
constexpr int kTrials = 16;                      // dampings tried in one step
constexpr double kDependent = 1e-10;             // of columns of S
constexpr double kTiny = 1e-13;                // of a diagonal, keeps unknowns without effect still
constexpr Eigen::Index kMaxCoupledModes = 32;  // modes; beyond, z and S take turns

/// Columns of length zero affect only E_s, whose gradient there is zero. They get the direction of
/// the largest residual, or any direction if there is no residual.
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
  return orthonormal_range(mixing, kDependent);
}

/// Rows l * r + k: sum over frames i of z_ki times row l of G E_i, E_i the rows of frame i. This is
/// the cross terms' transpose times E without their dense form, r times cheaper.
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

/// Columns [begin, end) of the cross terms of z and C(l, k), which moves the constraints of frame i
/// by S e_l z_ki; column l * r + k.
BandedCholesky::Columns cross_terms(const Eigen::MatrixXd& gram, const Eigen::MatrixXd& z,
                                    Eigen::Index begin, Eigen::Index end) {
  const Eigen::Index r = z.rows(), frames = z.cols();
  BandedCholesky::Columns cross(r * frames, end - begin);
  for (Eigen::Index column = begin; column < end; ++column) {
    const Eigen::Index l = column / r, k = column % r;
    for (Eigen::Index i = 0; i < frames; ++i)
      cross.col(column - begin).segment(i * r, r) = z(k, i) * gram.col(l);
  }
  return cross;
}

}  // namespace

/// The Gauss-Newton model at a point. S moves by S C + P, P orthogonal to the columns of S. To
/// first order the residuals of P are independent of those of z and C. Therefore only C is coupled
/// with z, which is eliminated.
struct RecoveryStep::Model {
  Model(const RecoveryEnergy& energy, const RecoveredMotion& at, const JobContext& job)
      : gram(at.mixing.transpose() * at.mixing),
        spread(at.z * at.z.transpose()),
        motion(energy.factor_motion(at)),
        by_motion(energy.gradient_of_motion(at)) {
    const Eigen::Index r = at.z.rows();
    const double weight = energy.weight();
    const Eigen::MatrixXd by_mixing = energy.gradient_of_mixing(at);
    couple(at.z, weight, job);
    for (Eigen::Index k = 0; k < r; ++k) {
      for (Eigen::Index l = 0; l < r; ++l) {
        for (Eigen::Index m = 0; m < r; ++m)
          schur(l * r + k, m * r + k) += 8 * energy.column_weight() * gram(l, k) * gram(m, k);
      }
    }
    BandedCholesky::Columns still = by_motion.reshaped();
    motion.solve(still);
    const BandedCholesky::Columns by_coupling = at.mixing.transpose() * by_mixing;  // l * r + k
    descent = weight * crossed(gram, at.z, still) - by_coupling.reshaped<Eigen::RowMajor>();

    const Eigen::MatrixXd range = range_of(at.mixing);
    outside = by_mixing - range * (range.transpose() * by_mixing);
  }

  /// The second derivative by C with z eliminated, but for E_s: some columns at a time.
  void couple(const Eigen::MatrixXd& z, double weight, const JobContext& job) {
    constexpr std::int64_t kTogether = 32;  // columns of one pass
    const Eigen::Index r = z.rows();
    schur.resize(r * r, r * r);
    parallel_for(r * r, kTogether, [&](std::int64_t begin, std::int64_t end) {
      job.throw_if_cancelled();
      BandedCholesky::Columns eliminated = weight * cross_terms(gram, z, begin, end);
      motion.solve(eliminated);
      schur.middleCols(begin, end - begin) = -weight * crossed(gram, z, eliminated);
    });
    for (Eigen::Index l = 0; l < r; ++l) {
      for (Eigen::Index m = 0; m < r; ++m)
        schur.block(l * r, m * r, r, r) += (weight * gram(l, m)) * spread;
    }
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
    const Eigen::VectorXd solution = damped.ldlt().solve(descent);
    const Eigen::MatrixXd coupling = solution.reshaped<Eigen::RowMajor>(r, r);
    Eigen::MatrixXd normal = weight * spread;
    normal.diagonal() +=
        weight *
        (damping * spread.diagonal().array() + kTiny * spread.diagonal().maxCoeff()).matrix();
    BandedCholesky::Columns dz = (weight * gram * coupling * at.z + by_motion).reshaped();
    motion.solve(dz);
    RecoveredMotion result = at;
    result.z -= dz.reshaped(r, at.z.cols());
    result.mixing += at.mixing * coupling - normal.ldlt().solve(outside.transpose()).transpose();
    return result;
  }

  Eigen::MatrixXd gram, spread;  // S^T S, z z^T
  BandedCholesky motion;         // the second derivative by z
  Eigen::MatrixXd by_motion;     // gradient by z
  Eigen::MatrixXd schur;         // of C, row-major pairs (l, k)
  Eigen::VectorXd descent;
  Eigen::MatrixXd outside;  // gradient by P
};

namespace {

/// S alone by a damped Newton step, then z: for numbers of modes whose coupling is too large.
RecoveredMotion alternated(const RecoveryEnergy& energy, const RecoveredMotion& at,
                           double damping) {
  const double weight = energy.weight();
  Eigen::MatrixXd normal = weight * (at.z * at.z.transpose());
  normal.diagonal() *= 1 + damping;
  normal.diagonal().array() += kTiny * normal.diagonal().maxCoeff();
  RecoveredMotion result = at;
  result.mixing -= normal.ldlt().solve(energy.gradient_of_mixing(at).transpose()).transpose();
  if (result.mixing.allFinite()) energy.fit_motion(result);
  return result;
}

}  // namespace

double RecoveryStep::take(RecoveredMotion& at, const JobContext& job) {
  const double before = energy_.value(at).total;
  revive_columns(energy_, at);
  std::optional<Model> model;
  if (at.z.rows() <= kMaxCoupledModes) model.emplace(energy_, at, job);
  for (int trial = 0; trial < kTrials; ++trial) {
    job.throw_if_cancelled();
    RecoveredMotion candidate =
        model ? model->moved(at, energy_.weight(), damping_) : alternated(energy_, at, damping_);
    if (candidate.z.allFinite() && candidate.mixing.allFinite()) {
      energy_.fit_dynamics(candidate);
      energy_.balance(candidate);
      const double after = energy_.value(candidate).total;
      if (after < before) {
        at = std::move(candidate);
        damping_ = std::max(damping_ / 3, kLeastRecoveredDamping);
        return before - after;
      }
    }
    damping_ *= 4;
  }
  return before - energy_.value(at).total;
}

}  // namespace limber::spacetime
