#include "engine/session/bodies/frame_steps.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "engine/base/parallel.h"

namespace limber::session {
namespace {

constexpr Eigen::Index kRowsAtOnce = 3072;  // of a product, between two looks at the cancellation
constexpr Eigen::Index kColumnsAtOnce = 32;

/// |B_i| of the node that coordinates may move farthest.
double widest_node(const Eigen::MatrixXd& basis) {
  double widest = 0;
  for (Eigen::Index row = 0; row < basis.rows(); row += 3)
    widest = std::max(widest, basis.middleRows<3>(row).squaredNorm());
  return std::sqrt(widest);
}

/// Squared, of each column.
Eigen::RowVectorXd farthest_of_columns(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& columns,
                                       const JobContext& job) {
  const auto blocks = (basis.rows() + kRowsAtOnce - 1) / kRowsAtOnce;
  Eigen::MatrixXd farthest(blocks, columns.cols());
  parallel_for(blocks, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) {
      job.throw_if_cancelled();
      const Eigen::Index row = i * kRowsAtOnce;
      const Eigen::MatrixXd moved =
          basis.middleRows(row, std::min(kRowsAtOnce, basis.rows() - row)) * columns;
      for (Eigen::Index k = 0; k < moved.cols(); ++k)
        farthest(i, k) =
            moved.col(k).reshaped(3, moved.rows() / 3).colwise().squaredNorm().maxCoeff();
    }
  });
  return farthest.colwise().maxCoeff();
}

/// The largest distance of a node over all columns. Columns that cannot have it are left out: none
/// moves a node farther than its own norm times that of the widest node.
FarthestMove farthest_move(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& columns,
                           const JobContext& job) {
  FarthestMove found;
  if (basis.rows() == 0 || columns.cols() == 0) return found;
  const Eigen::RowVectorXd norms = columns.colwise().norm();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(columns.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return norms[a] > norms[b]; });
  const double widest = widest_node(basis);
  for (Eigen::Index first = 0; first < columns.cols(); first += kColumnsAtOnce) {
    const auto begin = order.begin() + first;
    if (widest * norms[*begin] <= found.distance) break;
    const Eigen::Index count = std::min(kColumnsAtOnce, columns.cols() - first);
    const std::vector<Eigen::Index> chosen(begin, begin + count);
    Eigen::Index at = 0;
    const double farthest =
        std::sqrt(farthest_of_columns(basis, columns(Eigen::all, chosen), job).maxCoeff(&at));
    if (farthest > found.distance)
      found = {farthest, static_cast<int>(chosen[static_cast<std::size_t>(at)])};
  }
  return found;
}

}  // namespace

double largest_frame_step(const Eigen::MatrixXd& basis, const Eigen::MatrixXf& coordinates,
                          const JobContext& job) {
  const Eigen::Index steps = coordinates.cols() - 1;
  if (steps < 1) return 0;
  const Eigen::MatrixXd differences =
      (coordinates.rightCols(steps) - coordinates.leftCols(steps)).cast<double>();
  return farthest_move(basis, differences, job).distance;
}

FarthestMove zigzag(const Eigen::MatrixXd& basis, const Eigen::MatrixXf& coordinates,
                    const JobContext& job) {
  const Eigen::Index inner = coordinates.cols() - 2;
  if (inner < 1) return {};
  const Eigen::MatrixXd from_mean = coordinates.middleCols(1, inner).cast<double>() -
                                    0.5 * (coordinates.leftCols(inner).cast<double>() +
                                           coordinates.rightCols(inner).cast<double>());
  FarthestMove found = farthest_move(basis, from_mean, job);
  found.frame += 1;
  return found;
}

Eigen::MatrixXf around_seam(const Eigen::MatrixXf& coordinates) {
  Eigen::MatrixXf result(coordinates.rows(), coordinates.cols() + 2);
  result << coordinates.rightCols<1>(), coordinates, coordinates.leftCols<1>();
  return result;
}

FarthestMove farthest_from_rest(const Eigen::MatrixXd& basis, const Eigen::MatrixXf& coordinates,
                                const JobContext& job) {
  return farthest_move(basis, coordinates.cast<double>(), job);
}

Eigen::MatrixXd rows_of_some_nodes(const Eigen::MatrixXd& basis, int most) {
  const Eigen::Index nodes = basis.rows() / 3;
  const Eigen::Index count = std::min<Eigen::Index>(nodes, most);
  Eigen::MatrixXd rows(3 * count, basis.cols());
  for (Eigen::Index i = 0; i < count; ++i)
    rows.middleRows<3>(3 * i) = basis.middleRows<3>(3 * (i * nodes / count));
  return rows;
}

}  // namespace limber::session
