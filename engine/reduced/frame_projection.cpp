#include "engine/reduced/frame_projection.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/numerics/dense.h"
#include "engine/base/parallel.h"

namespace limber::reduced {
namespace {

using Eigen::Index;

constexpr Index kFramesPerBlock = 32;  // reconstructed between checks of cancellation
constexpr Index kLearntAtOnce = 32;    // frames whose components are found together
// Relative to the mean of the held sites' own: less than what single precision shows.
constexpr double kSiteRidge = 1e-9;
constexpr double kRounding = 1e-14;  // of squares: below it a component is noise

/// a^T b by blocks of columns of b, on all threads.
Eigen::MatrixXd coordinates_on(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                               const JobContext& job) {
  Eigen::MatrixXd result(a.cols(), b.cols());
  parallel_for((b.cols() + 7) / 8, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t block = begin; block < end; ++block) {
      job.throw_if_cancelled();
      const Index first = 8 * block, count = std::min<Index>(8, b.cols() - first);
      result.middleCols(first, count).noalias() = a.transpose() * b.middleCols(first, count);
    }
  });
  return result;
}

/// u <- u - a q, likewise.
void take_off(const Eigen::MatrixXd& a, const Eigen::MatrixXd& q, Eigen::MatrixXd& u,
              const JobContext& job) {
  parallel_for((u.cols() + 7) / 8, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t block = begin; block < end; ++block) {
      job.throw_if_cancelled();
      const Index first = 8 * block, count = std::min<Index>(8, u.cols() - first);
      u.middleCols(first, count).noalias() -= a * q.middleCols(first, count);
    }
  });
}

/// The components of `rest` that leave less than `limit` (a square) of it, or `most` of them.
Eigen::MatrixXd components(const Eigen::MatrixXd& rest, double limit, Index most) {
  const SymmetricEigen gram(rest.transpose() * rest);
  const Eigen::VectorXd& values = gram.eigenvalues();
  double left = values.cwiseMax(0.0).sum();
  const double whole = left;
  Index count = 0;
  while (count < std::min(most, values.size()) && left > limit &&
         values[values.size() - 1 - count] > kRounding * whole)
    left -= values[values.size() - 1 - count++];
  return rest * gram.eigenvectors().rightCols(count).rowwise().reverse();
}

/// Least change of each frame's coordinates that removes the error at its held sites.
void hold_sites(const Eigen::MatrixXd& basis, const Eigen::MatrixXd& columns,
                const Eigen::MatrixXd& rest, const std::vector<HeldSite>& held,
                Eigen::MatrixXd& coordinates) {
  std::map<int, std::vector<const HeldSite*>> by_column;
  for (const HeldSite& site : held) by_column[site.column].push_back(&site);
  for (const auto& [column, sites] : by_column) {
    const auto count = 3 * static_cast<Index>(sites.size());
    Eigen::MatrixXd rows(count, coordinates.rows());
    Eigen::VectorXd miss(count);
    for (Index i = 0; i < count; i += 3) {
      const Site& site = *sites[static_cast<std::size_t>(i / 3)]->site;
      rows.middleRows<3>(i) << mean_rows(basis, site), mean_rows(columns, site);
      miss.segment<3>(i) = mean_rows(rest.col(column), site);
    }
    // Sites that move together, or hardly, ask for no more than the basis can do.
    Eigen::MatrixXd gram = rows * rows.transpose();
    gram.diagonal().array() += kSiteRidge * gram.trace() / static_cast<double>(count);
    if (gram.trace() > 0) coordinates.col(column) += rows.transpose() * gram.ldlt().solve(miss);
  }
}

/// @param rest  u, 3n x k; @param whole  the square that errors are relative to
ProjectedFrames projected(Eigen::MatrixXd rest, double whole, const Eigen::MatrixXd& basis,
                          const std::vector<HeldSite>& held, const FrameProjectionOptions& options,
                          const JobContext& job) {
  const Index count = rest.cols();
  ProjectedFrames result;
  result.coordinates = coordinates_on(basis, rest, job);
  take_off(basis, result.coordinates, rest, job);
  result.columns.resize(basis.rows(), 0);
  const auto error = [&] { return whole > 0 ? std::sqrt(rest.squaredNorm() / whole) : 0.0; };
  result.error_before = result.error_after = error();
  const double limit = options.tolerance * options.tolerance * whole;
  while (result.error_after > options.tolerance && result.columns.cols() < options.max_columns) {
    job.throw_if_cancelled();
    std::vector<Index> worst(static_cast<std::size_t>(count));
    std::iota(worst.begin(), worst.end(), Index{0});
    const Eigen::VectorXd squares = rest.colwise().squaredNorm();
    std::stable_sort(worst.begin(), worst.end(),
                     [&](Index a, Index b) { return squares[a] > squares[b]; });
    worst.resize(static_cast<std::size_t>(std::min(kLearntAtOnce, count)));
    // Half of what may be left, so that few rounds are needed.
    const double share = static_cast<double>(worst.size()) / static_cast<double>(count);
    Eigen::MatrixXd added = components(rest(Eigen::all, worst), 0.25 * share * limit,
                                       options.max_columns - result.columns.cols());
    if (added.cols() == 0) break;
    for (int pass = 0; pass < 2; ++pass) {  // twice: orthogonal to rounding
      job.throw_if_cancelled();
      added -= basis * (basis.transpose() * added).eval();
      added -= result.columns * (result.columns.transpose() * added).eval();
      orthonormalise_columns(added);
    }
    const Eigen::MatrixXd q = coordinates_on(added, rest, job);
    take_off(added, q, rest, job);
    const Index before = result.columns.cols(), rows = result.coordinates.rows();
    result.columns.conservativeResize(Eigen::NoChange, before + added.cols());
    result.columns.rightCols(added.cols()) = added;
    result.coordinates.conservativeResize(rows + added.cols(), Eigen::NoChange);
    result.coordinates.bottomRows(added.cols()) = q;
    result.error_after = error();
  }
  hold_sites(basis, result.columns, rest, held, result.coordinates);
  return result;
}

}  // namespace

void FrameProjectionOptions::validate() const {
  if (!(tolerance > 0 && tolerance < 1))
    throw Error(ErrorCode::kInvalidArgument, "tolerance", "must be in (0, 1)");
  if (max_columns < 0) throw Error(ErrorCode::kInvalidArgument, "max_columns", "must be >= 0");
}

ProjectedFrames project_frames(FullShapes& shapes, const Eigen::MatrixXd& basis,
                               std::span<const int> frames,
                               const Eigen::Ref<const Eigen::MatrixXd>& modal,
                               const std::vector<HeldSite>& held,
                               const FrameProjectionOptions& options, const JobContext& job) {
  options.validate();
  const auto count = static_cast<Index>(frames.size());
  LIMBER_DEMAND(modal.cols() == count && modal.rows() == shapes.model().coordinate_count());
  LIMBER_DEMAND(basis.rows() == shapes.model().modes.rows());
  Eigen::MatrixXd shown(basis.rows(), count);
  for (Index first = 0; first < count; first += kFramesPerBlock) {
    const Index n = std::min(kFramesPerBlock, count - first);
    job.report("shapes", static_cast<double>(first) / static_cast<double>(count));
    const Eigen::MatrixXd linear = shapes.model().modes * modal.middleCols(first, n);
    shown.middleCols(first, n) = shapes.displacements(
        frames.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(n)), linear, job);
  }
  // Displacements of a free body count without their mean, as in MotionError.
  double whole = 0;
  for (Index i = 0; i < count; ++i) {
    const auto u = shown.col(i).reshaped(3, shown.rows() / 3);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    if (shapes.model().rigid_count > 0) mean = u.rowwise().mean();
    whole += (u.colwise() - mean).squaredNorm();
  }
  return projected(std::move(shown), whole, basis, held, options, job);
}

ProjectedFrames project_displacements(Eigen::MatrixXd displacements, const Eigen::MatrixXd& basis,
                                      const std::vector<HeldSite>& held,
                                      const FrameProjectionOptions& options,
                                      const JobContext& job) {
  options.validate();
  LIMBER_DEMAND(displacements.rows() == basis.rows());
  const double whole = displacements.squaredNorm();
  return projected(std::move(displacements), whole, basis, held, options, job);
}

}  // namespace limber::reduced
