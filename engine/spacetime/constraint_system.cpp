#include "engine/spacetime/constraint_system.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "engine/base/error.h"

namespace limber::spacetime {

void response_of_terms(const GreenBlocks& green, const std::vector<TermBlock>& blocks,
                       const Lanes& jacobian, Lanes& scaled, Eigen::MatrixXd& system) {
  const auto lanes = jacobian.rows();
  Eigen::Index n = 0;
  for (const TermBlock& block : blocks) n += block.count;
  system.resize(n, n);
  scaled.resize(lanes, n);
  Eigen::Index first = 0;
  for (int i = 0; i < static_cast<int>(blocks.size()); ++i) {
    const TermBlock& block = blocks[static_cast<std::size_t>(i)];
    Eigen::Index column = 0;
    for (int j = 0; j <= i; ++j) {
      const TermBlock& other = blocks[static_cast<std::size_t>(j)];
      const double* __restrict between = green(i, j);
      for (int row = other.first; row < other.first + other.count; ++row, ++column) {
        const double* along = jacobian.col(row).data();
        double* __restrict out = scaled.col(column).data();
        for (Eigen::Index k = 0; k < lanes; ++k) out[k] = between[k] * along[k];
      }
    }
    system.block(first, 0, block.count, column).noalias() =
        jacobian.middleCols(block.first, block.count).transpose() * scaled.leftCols(column);
    first = column;
  }
}

void sum_terms(const std::vector<int>& places, Eigen::Index count, Eigen::MatrixXd& system,
               Eigen::MatrixXd& work) {
  const Eigen::Index terms = system.rows();
  if (terms == count) return;
  work.swap(system);
  system.setZero(count, count);
  for (Eigen::Index column = 0; column < terms; ++column) {
    const Eigen::Index j = places[static_cast<std::size_t>(column)];
    for (Eigen::Index row = column; row < terms; ++row) {
      const Eigen::Index i = places[static_cast<std::size_t>(row)];
      // Two terms of one row meet in its diagonal from both sides.
      const double value = row != column && i == j ? 2 * work(row, column) : work(row, column);
      system(std::max(i, j), std::min(i, j)) += value;
    }
  }
}

void factor_lifted(Eigen::MatrixXd& system, Eigen::MatrixXd& work) {
  const Eigen::VectorXd diagonal = system.diagonal();
  const double largest = diagonal.size() > 0 ? diagonal.maxCoeff() : 0;
  const auto factors = [&](double lift) {
    work = system;
    work.diagonal().array() += lift * largest;
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(work);
    return llt.info() == Eigen::Success;
  };
  if (factors(0) || raise_shift(kLifts, factors)) return system.swap(work);
  throw Error(ErrorCode::kNumerical, "",
              "the constraints' system cannot be factored: displacements or their Jacobians are "
              "not finite");
}

}  // namespace limber::spacetime
