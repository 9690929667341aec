#include "engine/bodies/modal_analysis.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"
#include "engine/bodies/block_krylov.h"
#include "engine/bodies/dof_map.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/lanczos.h"
#include "engine/bodies/mass.h"
#include "engine/bodies/rigid_modes.h"
#include "engine/bodies/shift_invert.h"
#include "engine/bodies/stiffness.h"

namespace limber::bodies {
namespace {

// Below this size all eigenpairs by a dense solver are cheaper than a factor and Lanczos.
constexpr Eigen::Index kDenseSize = 300;
// Random columns beside the wanted ones: they show modes that Lanczos skipped (copies of multiple
// eigenvalues).
constexpr int kGuards = 8;
constexpr int kLeastSteps = 2;
constexpr int kMaxSteps = 12;
// Eigenvalue given to mechanisms, relative to the first stiff one.
constexpr double kMechanismShare = 1e-4;
// A mode is a mechanism if its strain energy, which is free of cancellation, is below this share of
// the rounding of phi^T K phi.
constexpr double kMechanismNoise = 1e-6;
// If many of all modes are requested, Lanczos has no advantage up to the largest size for a dense
// solver.
constexpr Eigen::Index kLargestDenseSize = 3000;
// Progress when the matrices are there, the factor, and the modes of Lanczos: about the times of
// 200,000 tets.
constexpr double kAssembled = 0.05;
constexpr double kFactored = 0.5;
constexpr double kIterated = 0.85;

/// All modes by LAPACK-like dense reduction. Rigid modes are moved to the far end by M R tau R^T M.
Eigen::MatrixXd dense_modes(const ShiftInvert& op, const Eigen::MatrixXd& rigid, int count) {
  Eigen::MatrixXd stiffness = op.stiffness();
  const Eigen::MatrixXd mass = op.mass();
  if (rigid.cols() > 0) {
    const Eigen::MatrixXd mass_rigid = mass * rigid * std::sqrt(op.mass_unit());
    const double beyond = 10 * (stiffness.diagonal().array() / mass.diagonal().array()).sum();
    stiffness += beyond * mass_rigid * mass_rigid.transpose();
  }
  const GeneralizedSymmetricEigen solver(stiffness, mass);
  if (!solver.has_converged()) {
    throw Error(ErrorCode::kNumerical, "modes", "the dense eigenproblem could not be solved");
  }
  return solver.eigenvectors().leftCols(count);
}

Eigen::MatrixXd krylov_modes(const ShiftInvert& op, int count, int elastic_count,
                             const ModalOptions& options, const JobContext& job) {
  const double tolerance = options.tolerance / 10;
  if (auto modes = block_krylov_modes(op, count, tolerance, job)) return std::move(*modes);
  return lanczos_modes(op, count, elastic_count, tolerance, options.max_restarts, job);
}

Eigen::MatrixXd with_guards(const ShiftInvert& op, const Eigen::MatrixXd& modes, int guards) {
  Eigen::MatrixXd block(modes.rows(), modes.cols() + guards);
  block.leftCols(modes.cols()) = modes;
  Random random(3);
  auto extra = block.rightCols(guards);
  for (Eigen::Index k = 0; k < guards; ++k) {
    for (Eigen::Index i = 0; i < modes.rows(); ++i) extra(i, k) = random.uniform(-1, 1);
  }
  const Eigen::MatrixXd overlap = op.multiply_mass(modes).transpose() * extra;
  extra -= modes * overlap;
  op.project(extra);
  return block;
}

double worst_residual(const ShiftInvert& op, const RitzBlock& ritz, int count) {
  const Eigen::VectorXd flexibility = op.stiffness().diagonal().cwiseInverse();
  std::vector<double> squares(static_cast<std::size_t>(count));
  parallel_for(count, 4, [&](std::int64_t begin, std::int64_t end) {
    for (auto k = static_cast<int>(begin); k < static_cast<int>(end); ++k) {
      const double lambda = ritz.eigenvalues[k];
      const Eigen::VectorXd residual =
          op.stiffness() * ritz.vectors.col(k) - lambda * ritz.mass_vectors.col(k);
      squares[k] = residual.cwiseAbs2().dot(flexibility) / std::max(lambda, op.shift());
    }
  });
  return std::sqrt(*std::max_element(squares.begin(), squares.end()));
}

/// Subspace steps until the residual tolerance is met or rounding allows no better.
std::pair<RitzBlock, double> polish(const ShiftInvert& op, Eigen::MatrixXd block, int count,
                                    double tolerance, const JobContext& job) {
  RitzBlock ritz;
  ritz.mass_vectors = op.multiply_mass(block);
  block.resize(0, 0);
  double residual = 0;
  for (int step = 1; step <= kMaxSteps; ++step) {
    job.report("modes", static_cast<double>(step - 1) / kMaxSteps);
    ritz = subspace_step(op, ritz.mass_vectors);
    if (step < kLeastSteps) continue;
    const double before = residual;
    residual = worst_residual(op, ritz, count);
    if (residual <= tolerance || (step > kLeastSteps && residual > 0.7 * before)) break;
  }
  return {std::move(ritz), residual};
}

/// Largest rounding error of phi^T K phi: eps |phi|^T |K| |phi|, with room for the length of the
/// sums.
double energy_noise(const Eigen::SparseMatrix<double>& absolute_stiffness,
                    const Eigen::Ref<const Eigen::VectorXd>& mode) {
  const Eigen::VectorXd size = mode.cwiseAbs();
  return 10 * std::numeric_limits<double>::epsilon() * size.dot(absolute_stiffness * size);
}

/// The elastic pairs over all degrees of freedom, guards included.
struct FullPairs {
  Eigen::VectorXd eigenvalues;
  Eigen::MatrixXd modes;
  Eigen::VectorXd residuals;  // as ModalBasis::max_residual
  Eigen::VectorXd errors;     // as ModalBasis::eigenvalue_error
  int mechanism_count = 0;
};

/// Eigenvalues as Rayleigh quotients of strain energies: those of the projected problem carry the
/// rounding of the stiffest part, these only the square of the error of the mode.
FullPairs refine_eigenvalues(const ElasticBody& body, const DofMap& dofs, const ShiftInvert& op,
                             const RitzBlock& ritz) {
  FullPairs pairs;
  pairs.modes = dofs.expand_rows(ritz.vectors) / std::sqrt(op.mass_unit());
  const GradientOperator gradient(body.mesh);
  const Eigen::SparseMatrix<double> absolute = op.stiffness().cwiseAbs();
  const Eigen::Index count = ritz.vectors.cols();
  pairs.eigenvalues.resize(count);
  pairs.residuals.resize(count);
  Eigen::VectorXd noise(count);
  Eigen::MatrixXd residuals(ritz.vectors.rows(), count);
  const Eigen::VectorXd flexibility = op.stiffness().diagonal().cwiseInverse();
  parallel_for(count, 1, [&](std::int64_t k, std::int64_t) {
    pairs.eigenvalues[k] = 2 * strain_energy(body.mesh, gradient, pairs.modes.col(k));
    noise[k] = energy_noise(absolute, ritz.vectors.col(k));
    // The sums in K have rounded: a mode that agrees with them need not agree with the body.
    const Eigen::VectorXd forces =
        dofs.restrict_rows(elastic_forces(body.mesh, gradient, pairs.modes.col(k))) /
        std::sqrt(op.mass_unit());
    residuals.col(k) = forces - pairs.eigenvalues[k] * ritz.mass_vectors.col(k);
    pairs.residuals[k] = std::sqrt(residuals.col(k).cwiseAbs2().dot(flexibility) /
                                   std::max(pairs.eigenvalues[k], op.shift()));
  });
  const Eigen::MatrixXd corrections = op.solve(residuals);
  pairs.errors = (residuals.cwiseProduct(corrections).colwise().sum().transpose().array() /
                  pairs.eigenvalues.array().max(op.shift()))
                     .max(0)
                     .sqrt();
  while (pairs.mechanism_count < count && pairs.eigenvalues[pairs.mechanism_count] <=
                                              kMechanismNoise * noise[pairs.mechanism_count]) {
    ++pairs.mechanism_count;
  }
  return pairs;
}

/// Ascending order after refinement; mechanisms stay first and get their share of the first other
/// eigenvalue.
void order_pairs(FullPairs& pairs, double smallest_unit) {
  const auto first = pairs.mechanism_count;
  std::vector<int> order(static_cast<std::size_t>(pairs.eigenvalues.size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin() + first, order.end(),
                   [&](int a, int b) { return pairs.eigenvalues[a] < pairs.eigenvalues[b]; });
  pairs.eigenvalues = Eigen::VectorXd(pairs.eigenvalues(order));
  pairs.modes = Eigen::MatrixXd(pairs.modes(Eigen::all, order));
  pairs.residuals = Eigen::VectorXd(pairs.residuals(order));
  pairs.errors = Eigen::VectorXd(pairs.errors(order));
  const double unit = first < pairs.eigenvalues.size() ? pairs.eigenvalues[first] : smallest_unit;
  pairs.eigenvalues.head(first).setConstant(kMechanismShare * unit);
}

/// The largest entry becomes positive; of entries equal up to rounding the first decides, so that a
/// change of units or of compiler does not flip symmetric modes.
void fix_sign(Eigen::Ref<Eigen::VectorXd> mode) {
  const double largest = mode.cwiseAbs().maxCoeff();
  for (const double entry : mode) {
    if (std::abs(entry) < (1 - 1e-6) * largest) continue;
    if (entry < 0) mode = -mode;
    return;
  }
}

void check_mode_count(int requested, int available) {
  if (requested <= available) return;
  throw Error(ErrorCode::kInvalidArgument, "mode_count",
              fmt::format("{} modes requested, the body has {} elastic degrees of freedom",
                          requested, std::max(0, available)));
}

}  // namespace

void ModalOptions::validate() const {
  if (mode_count <= 0) {
    throw Error(ErrorCode::kInvalidArgument, "mode_count",
                fmt::format("mode_count must be > 0, not {}", mode_count));
  }
  if (!(tolerance > 0 && tolerance <= 1e-2)) {
    throw Error(ErrorCode::kInvalidArgument, "tolerance",
                fmt::format("tolerance must be in (0, 1e-2], not {}", tolerance));
  }
  if (max_restarts <= 0) {
    throw Error(ErrorCode::kInvalidArgument, "max_restarts",
                fmt::format("max_restarts must be > 0, not {}", max_restarts));
  }
}

ModalBasis modal_analysis(const ElasticBody& body, const ModalOptions& options,
                          const JobContext& job) {
  options.validate();
  job.report("modes", 0);
  const DofMap dofs = DofMap::of_vectors(body.mesh.node_count(), body.fixed_nodes);
  Eigen::MatrixXd rigid(dofs.full_count(), 0);
  if (body.is_free()) rigid = rigid_modes(body.mesh).modes;
  const int rigid_count = static_cast<int>(rigid.cols());
  const int elastic_count = dofs.free_count() - rigid_count;
  check_mode_count(options.mode_count, elastic_count);

  job.report("modes", kAssembled / 2);
  const ShiftInvert op(dofs.restrict_matrix(stiffness_matrix(body.mesh)),
                       dofs.restrict_matrix(mass_matrix(body.mesh)), dofs.restrict_rows(rigid),
                       job.part(kAssembled, kFactored));

  const int count = options.mode_count;
  const bool dense =
      op.size() <= kDenseSize || (op.size() <= kLargestDenseSize && count > elastic_count / 4);
  const Eigen::MatrixXd start =
      dense ? dense_modes(op, rigid, count)
            : krylov_modes(op, count, elastic_count, options, job.part(kFactored, kIterated));
  const int guards = std::min(kGuards, elastic_count - count);
  const auto [ritz, residual] = polish(op, with_guards(op, start, guards), count, options.tolerance,
                                       job.part(kIterated, 0.95));

  job.report("modes", 0.95);
  FullPairs pairs = refine_eigenvalues(body, dofs, op, ritz);
  order_pairs(pairs, op.shift());

  ModalBasis basis;
  basis.rigid_count = rigid_count;
  basis.max_residual = std::max(residual, pairs.residuals.head(count).maxCoeff());
  basis.mechanism_count = std::min(pairs.mechanism_count, count);
  for (int k = basis.mechanism_count; k < count; ++k)
    basis.eigenvalue_error = std::max(basis.eigenvalue_error, pairs.errors[k]);
  basis.eigenvalues.setZero(rigid_count + count);
  basis.eigenvalues.tail(count) = pairs.eigenvalues.head(count);
  basis.modes.resize(dofs.full_count(), rigid_count + count);
  basis.modes.leftCols(rigid_count) = rigid;
  basis.modes.rightCols(count) = pairs.modes.leftCols(count);
  for (int k = rigid_count; k < basis.modes.cols(); ++k) fix_sign(basis.modes.col(k));
  job.report("modes", 1);
  return basis;
}

}  // namespace limber::bodies
