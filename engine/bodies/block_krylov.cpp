#include "engine/bodies/block_krylov.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"
#include "engine/base/random.h"

namespace limber::bodies {
namespace {

constexpr Eigen::Index kBlock = 16;   // columns of a step
constexpr Eigen::Index kRows = 2048;  // of one parallel piece of a product
// Columns of the space at most, for each vector that is wanted, and beside these.
constexpr int kMaxColumnsPerVector = 8;
// Ritz pairs are a dense eigenproblem: looked at each time the space has grown by so much.
constexpr double kLookGrowth = 1.12;
constexpr int kMoreColumns = 4 * static_cast<int>(kBlock);
// A block whose columns depend on each other by more than this has nothing new to give.
constexpr double kDependent = 1e-12;

/// A^T B by fixed pieces of rows: the same for any number of threads.
Eigen::MatrixXd product_transposed(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                   const Eigen::Ref<const Eigen::MatrixXd>& b) {
  constexpr std::int64_t kParts = 16;
  const Eigen::Index rows = (a.rows() + kParts - 1) / kParts;
  std::vector<Eigen::MatrixXd> parts(kParts, Eigen::MatrixXd::Zero(a.cols(), b.cols()));
  parallel_for(kParts, 1, [&](std::int64_t part, std::int64_t) {
    const Eigen::Index first = part * rows, n = std::min(rows, a.rows() - first);
    if (n <= 0) return;
    parts[static_cast<std::size_t>(part)].noalias() =
        a.middleRows(first, n).transpose() * b.middleRows(first, n);
  });
  for (std::size_t part = 1; part < parts.size(); ++part) parts[0] += parts[part];
  return std::move(parts[0]);
}

/// W <- W - V C.
void subtract_product(const Eigen::Ref<const Eigen::MatrixXd>& v, const Eigen::MatrixXd& c,
                      Eigen::MatrixXd& w) {
  parallel_for((w.rows() + kRows - 1) / kRows, 1, [&](std::int64_t piece, std::int64_t) {
    const Eigen::Index first = piece * kRows, n = std::min(kRows, w.rows() - first);
    w.middleRows(first, n).noalias() -= v.middleRows(first, n) * c;
  });
}

/// W R^-1.
Eigen::MatrixXd combined(const Eigen::MatrixXd& w, const Eigen::MatrixXd& inverse) {
  Eigen::MatrixXd result(w.rows(), inverse.cols());
  parallel_for((w.rows() + kRows - 1) / kRows, 1, [&](std::int64_t piece, std::int64_t) {
    const Eigen::Index first = piece * kRows, n = std::min(kRows, w.rows() - first);
    result.middleRows(first, n).noalias() = w.middleRows(first, n) * inverse;
  });
  return result;
}

/// Columns and M times them: kept together, since products with M cost more than those of blocks.
struct Block {
  Eigen::MatrixXd vectors, mass_vectors;
};

/// W <- W R^-1, M-orthonormal, by Cholesky of W^T M W. @returns R; nothing where columns depend on
/// each other
std::optional<Eigen::MatrixXd> orthonormalise(Block& w) {
  const Eigen::MatrixXd gram = product_transposed(w.vectors, w.mass_vectors);
  const Eigen::VectorXd scale = gram.diagonal().cwiseSqrt();
  if (!(scale.minCoeff() > 0) || !scale.allFinite()) return std::nullopt;
  const Eigen::MatrixXd scaled =
      scale.cwiseInverse().asDiagonal() * gram * scale.cwiseInverse().asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd> cholesky(scaled);
  if (cholesky.info() != Eigen::Success) return std::nullopt;
  const Eigen::MatrixXd lower = cholesky.matrixL();
  if (lower.diagonal().minCoeff() < std::sqrt(kDependent)) return std::nullopt;
  const Eigen::MatrixXd upper = lower.transpose() * scale.asDiagonal();
  const Eigen::MatrixXd inverse = upper.triangularView<Eigen::Upper>().solve(
      Eigen::MatrixXd::Identity(upper.rows(), upper.cols()));
  w.vectors = combined(w.vectors, inverse);
  w.mass_vectors = combined(w.mass_vectors, inverse);
  return upper;
}

/// Twice, since once leaves the rounding of a badly conditioned block.
std::optional<Eigen::MatrixXd> orthonormalise_twice(Block& w) {
  const auto first = orthonormalise(w);
  if (!first) return std::nullopt;
  const auto second = orthonormalise(w);
  if (!second) return std::nullopt;
  return *second * *first;
}

}  // namespace

std::optional<Eigen::MatrixXd> block_krylov_modes(const ShiftInvert& op, int count,
                                                  double tolerance, const JobContext& job) {
  // A block more than there are directions would be dependent.
  const Eigen::Index room = op.size() / 2;
  const Eigen::Index most =
      std::min<Eigen::Index>(room, Eigen::Index{kMaxColumnsPerVector} * count + kMoreColumns);
  if (most < count + 2 * kBlock) return std::nullopt;

  Random random(2);
  Block block{Eigen::MatrixXd(op.size(), kBlock), {}};
  for (double& entry : block.vectors.reshaped()) entry = random.uniform(-1, 1);
  op.project(block.vectors);
  block.mass_vectors = op.multiply_mass(block.vectors);
  if (!orthonormalise_twice(block)) return std::nullopt;

  Eigen::MatrixXd space(op.size(), most), mass_space(op.size(), most);  // V, M V
  Eigen::MatrixXd projected = Eigen::MatrixXd::Zero(most, most);        // V^T M OP V
  Eigen::Index size = 0, next_look = count + kBlock;
  while (size + kBlock <= most) {
    job.report("modes", std::min(1.0, static_cast<double>(size) / (4.0 * count + kBlock)));
    space.middleCols(size, kBlock) = block.vectors;
    mass_space.middleCols(size, kBlock) = block.mass_vectors;
    size += kBlock;
    Block next{op.solve_in_pieces(block.mass_vectors), {}};
    next.mass_vectors = op.multiply_mass(next.vectors);
    Eigen::MatrixXd along = Eigen::MatrixXd::Zero(size, kBlock);
    for (int pass = 0; pass < 2; ++pass) {
      const Eigen::MatrixXd part = product_transposed(space.leftCols(size), next.mass_vectors);
      subtract_product(space.leftCols(size), part, next.vectors);
      subtract_product(mass_space.leftCols(size), part, next.mass_vectors);
      along += part;
    }
    projected.block(0, size - kBlock, size, kBlock) = along;
    projected.block(size - kBlock, 0, kBlock, size) = along.transpose();
    const auto beyond = orthonormalise_twice(next);
    if (!beyond) return std::nullopt;
    block = std::move(next);
    if (size < next_look) continue;
    next_look =
        std::max(size + kBlock, static_cast<Eigen::Index>(kLookGrowth * static_cast<double>(size)));
    const SymmetricEigen ritz(projected.topLeftCorner(size, size));
    const Eigen::MatrixXd vectors = ritz.eigenvectors().rightCols(count).rowwise().reverse();
    const Eigen::VectorXd values = ritz.eigenvalues().tail(count).reverse();
    const Eigen::VectorXd residuals =
        (*beyond * vectors.bottomRows(kBlock)).colwise().norm().transpose();
    if ((residuals.array() <= tolerance * values.array()).all()) {
      Eigen::MatrixXd result = Eigen::MatrixXd::Zero(op.size(), count);
      subtract_product(space.leftCols(size), -vectors, result);
      return result;
    }
  }
  return std::nullopt;
}

}  // namespace limber::bodies
