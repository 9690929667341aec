#include "engine/session/bodies/frame_steps.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/base/parallel.h"

namespace limber::session {
namespace {

constexpr Eigen::Index kRowsAtOnce = 3072;  // of a product, between two looks at the cancellation

}  // namespace

double largest_frame_step(const Eigen::MatrixXd& basis, const Eigen::MatrixXf& coordinates,
                          const JobContext& job) {
  const Eigen::Index steps = coordinates.cols() - 1;
  if (steps < 1) return 0;
  const Eigen::MatrixXd differences =
      (coordinates.rightCols(steps) - coordinates.leftCols(steps)).cast<double>();
  std::vector<double> largest(
      static_cast<std::size_t>((basis.rows() + kRowsAtOnce - 1) / kRowsAtOnce));
  parallel_for(
      static_cast<std::int64_t>(largest.size()), 1, [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          job.throw_if_cancelled();
          const Eigen::Index row = i * kRowsAtOnce;
          const Eigen::MatrixXd moved =
              basis.middleRows(row, std::min(kRowsAtOnce, basis.rows() - row)) * differences;
          largest[static_cast<std::size_t>(i)] =
              std::sqrt(moved.reshaped(3, moved.size() / 3).colwise().squaredNorm().maxCoeff());
        }
      });
  return *std::max_element(largest.begin(), largest.end());
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
