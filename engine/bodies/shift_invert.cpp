#include "engine/bodies/shift_invert.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"

namespace limber::bodies {
namespace {

// First guess of the shift, relative to the smallest K_ii / M_ii (about the largest eigenvalue of
// the softest region).
constexpr double kFirstShift = 1e-6;
// The shift is kept if it is at most this share of the first eigenvalue: then convergence is as
// good as without.
constexpr double kLargestShare = 0.5;
// Else it becomes this share.
constexpr double kTargetShare = 0.05;
constexpr int kAttempts = 6;

constexpr const char* kModesStage = "modes";
// Shares of an attempt's time, and the share of the remaining progress that an attempt leaves to
// the others.
constexpr double kAnalysisShare = 0.4;
constexpr double kFactorShare = 0.7;
constexpr double kLeftAfterAttempt = 0.2;

constexpr int kEstimateColumns = 4;
constexpr int kEstimateSteps = 5;

}  // namespace

Eigen::MatrixXd multiply_columns(const Eigen::SparseMatrix<double>& matrix,
                                 const Eigen::MatrixXd& x) {
  constexpr std::int64_t kColumns = 8;
  Eigen::MatrixXd result(matrix.rows(), x.cols());
  parallel_for(x.cols(), kColumns, [&](std::int64_t begin, std::int64_t end) {
    result.middleCols(begin, end - begin).noalias() = matrix * x.middleCols(begin, end - begin);
  });
  return result;
}

ShiftInvert::ShiftInvert(Eigen::SparseMatrix<double> stiffness, Eigen::SparseMatrix<double> mass,
                         Eigen::MatrixXd rigid, const JobContext& job)
    : stiffness_(std::move(stiffness)), mass_(std::move(mass)), rigid_(std::move(rigid)) {
  LIMBER_DEMAND(stiffness_.rows() == mass_.rows() && stiffness_.rows() > 0);
  LIMBER_DEMAND(rigid_.cols() == 0 || rigid_.rows() == mass_.rows());
  mass_unit_ = mass_.diagonal().mean();
  mass_ /= mass_unit_;
  stiffness_ /= mass_unit_;
  rigid_ *= std::sqrt(mass_unit_);
  mass_rigid_ = mass_ * rigid_;

  const double softest = (stiffness_.diagonal().array() / mass_.diagonal().array()).minCoeff();
  double shift = kFirstShift * softest;
  for (int attempt = 1;; ++attempt) {
    // Most bodies need one attempt, none is known to be the last: each takes most of the remaining
    // progress.
    const JobContext part = job.part(1 - std::pow(kLeftAfterAttempt, attempt - 1),
                                     1 - std::pow(kLeftAfterAttempt, attempt));
    try {
      factor(shift, part);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kNumerical || attempt >= kAttempts) throw;
      shift *= 100;
      continue;
    }
    first_eigenvalue_ = estimate_first_eigenvalue(part.part(kFactorShare, 1));
    if (shift <= kLargestShare * first_eigenvalue_ || attempt >= kAttempts) return;
    // A mechanism has lambda_1 = 0: approach it in bounded steps, and not below what rounding
    // resolves.
    const double smaller = std::max(kTargetShare * first_eigenvalue_, 1e-3 * shift);
    if (smaller < 1e-12 * softest) return;
    shift = smaller;
  }
}

void ShiftInvert::factor(double shift, const JobContext& job) {
  job.report(kModesStage, 0);
  shift_ = shift;
  const Eigen::SparseMatrix<double> shifted = stiffness_ + shift * mass_;
  // CHOLMOD cannot be stopped inside its two halves, of which either takes seconds for large
  // bodies.
  if (cholesky_.size() == 0) cholesky_.analyse(shifted);
  job.report(kModesStage, kAnalysisShare);
  cholesky_.refactor(shifted);
  job.report(kModesStage, kFactorShare);
}

double ShiftInvert::estimate_first_eigenvalue(const JobContext& job) const {
  Random random(1);
  const Eigen::Index columns = std::min<Eigen::Index>(kEstimateColumns, size() - rigid_.cols());
  LIMBER_DEMAND(columns > 0);
  Eigen::MatrixXd x(size(), columns);
  for (double& entry : x.reshaped()) entry = random.uniform(-1, 1);
  project(x);
  RitzBlock ritz;
  ritz.mass_vectors = multiply_mass(x);
  for (int step = 0; step < kEstimateSteps; ++step) {
    job.report(kModesStage, static_cast<double>(step) / kEstimateSteps);
    ritz = subspace_step(*this, ritz.mass_vectors);
  }
  return std::max(0.0, ritz.eigenvalues[0]);
}

Eigen::MatrixXd ShiftInvert::multiply_mass(const Eigen::MatrixXd& x) const {
  return multiply_columns(mass_, x);
}

Eigen::MatrixXd ShiftInvert::solve(Eigen::MatrixXd b) const {
  cholesky_.solve_in_place(b);
  project(b);
  return b;
}

Eigen::MatrixXd ShiftInvert::solve_in_pieces(Eigen::MatrixXd b) const {
  constexpr std::int64_t kColumns = 8;
  parallel_for(b.cols(), kColumns, [&](std::int64_t begin, std::int64_t end) {
    SparseCholesky::Workspace workspace;
    cholesky_.solve_in_place(b.middleCols(begin, end - begin), workspace);
  });
  project(b);
  return b;
}

void ShiftInvert::solve_in_place(Eigen::Ref<Eigen::VectorXd> b,
                                 SparseCholesky::Workspace& workspace) const {
  cholesky_.solve_in_place(b, workspace);
  project(b);
}

void ShiftInvert::project(Eigen::Ref<Eigen::MatrixXd> x) const {
  if (rigid_.cols() == 0) return;
  const Eigen::MatrixXd coefficients = mass_rigid_.transpose() * x;
  x.noalias() -= rigid_ * coefficients;
}

RitzBlock subspace_step(const ShiftInvert& op, const Eigen::MatrixXd& mass_x) {
  const Eigen::MatrixXd y = op.solve(mass_x);
  const Eigen::MatrixXd mass_y = op.multiply_mass(y);
  // Y^T (K + s M) Y = Y^T M X: the stiffness is never multiplied.
  Eigen::MatrixXd projected_stiffness = y.transpose() * mass_x;
  Eigen::MatrixXd projected_mass = y.transpose() * mass_y;
  const Eigen::VectorXd scale = projected_mass.diagonal().cwiseSqrt().cwiseInverse();
  projected_stiffness = scale.asDiagonal() * projected_stiffness * scale.asDiagonal();
  projected_mass = scale.asDiagonal() * projected_mass * scale.asDiagonal();
  const Eigen::MatrixXd symmetric = (projected_stiffness + projected_stiffness.transpose()) / 2;
  const GeneralizedSymmetricEigen solver(symmetric, projected_mass);
  if (!solver.has_converged()) {
    throw Error(ErrorCode::kNumerical, "modes", "the projected eigenproblem could not be solved");
  }
  const Eigen::MatrixXd combination = scale.asDiagonal() * solver.eigenvectors();
  RitzBlock result;
  result.eigenvalues = solver.eigenvalues().array() - op.shift();
  result.vectors.noalias() = y * combination;
  result.mass_vectors.noalias() = mass_y * combination;
  return result;
}

}  // namespace limber::bodies
