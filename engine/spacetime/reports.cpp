#include <algorithm>
#include <cmath>
#include <sstream>

#include "engine/spacetime/optimizer.h"

#include "engine/base/numerics/dense.h"

namespace limber::spacetime {
namespace {

/// The exact rows of one knot.
std::vector<int> exact_rows(const ConstraintRows& rows, int knot) {
  std::vector<int> found;
  for (int row = rows.first_row(knot); row < rows.first_row(knot + 1); ++row) {
    if (rows.exact(row)) found.push_back(row);
  }
  return found;
}

/// Two frames never depend on each other (no z is excluded, only costly), so dependence is a matter
/// of one frame's Jacobian: pivots of J J^T, as squares of those of a pivoted QR of J^T.
struct FrameRank {
  PivotedQr qr;
  Eigen::Index rank = 0;
};

FrameRank frame_rank(const Lanes& jacobian, const std::vector<int>& rows, double tolerance) {
  Eigen::MatrixXd transposed(jacobian.rows(), static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    transposed.col(static_cast<Eigen::Index>(i)) = jacobian.col(rows[i]);
  }
  FrameRank result{pivoted_qr(transposed), 0};
  const auto pivots = result.qr.r.diagonal();
  for (Eigen::Index i = 0; i < pivots.size(); ++i) {
    if (pivots[i] != 0 && pivots[i] * pivots[i] > tolerance * pivots[0] * pivots[0]) ++result.rank;
  }
  return result;
}

}  // namespace

bool Optimizer::only_contradiction_left() const {
  if (state_.jacobian.cols() != rows_.count()) return false;
  bool deficient = false;
  // Contradiction times a heavy weight is what the merit then consists of: smaller errors than this
  // no longer show in it.
  const double seen = std::sqrt(kRounding * merit(z_, state_) / rows_.exact_weight());
  const double tolerance = std::max(options_.constraint_tolerance, seen);
  for (int knot = 0; knot < static_cast<int>(rows_.knots().size()); ++knot) {
    const std::vector<int> rows = exact_rows(rows_, knot);
    if (rows.empty()) continue;
    Eigen::VectorXd residual(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i)
      residual[static_cast<Eigen::Index>(i)] = state_.residual[rows[i]];
    if (residual.cwiseAbs().maxCoeff() <= tolerance) continue;
    const FrameRank frame = frame_rank(state_.jacobian, rows, options_.rank_tolerance);
    if (frame.rank == static_cast<Eigen::Index>(rows.size())) return false;
    deficient = true;
    // The part of the residual that some change of z would lower: its projection on the range of J.
    const Eigen::VectorXd permuted = frame.qr.permuted(residual);
    const Eigen::VectorXd rotated =
        rotate_by_qr(frame.qr.r.topRows(frame.rank).transpose(), permuted);
    if (rotated.head(frame.rank).cwiseAbs().maxCoeff() > tolerance) return false;
  }
  return deficient;
}

void Optimizer::say_rank(SolveReport& report) const {
  const auto& fixed = rows_.fixed();
  int unmovable = 0;
  for (Eigen::Index i = 0; i < fixed.residual.size(); ++i) {
    if (std::isinf(fixed.weight[i])) ++unmovable;
  }
  report.dependent_rows = unmovable;
  if (rows_.exact_count() > 0 && state_.jacobian.cols() == rows_.count()) {
    for (int knot = 0; knot < static_cast<int>(rows_.knots().size()); ++knot) {
      const std::vector<int> rows = exact_rows(rows_, knot);
      if (rows.empty()) continue;
      report.dependent_rows +=
          static_cast<int>(static_cast<Eigen::Index>(rows.size()) -
                           frame_rank(state_.jacobian, rows, options_.rank_tolerance).rank);
    }
  }
  report.rank_deficient = report.dependent_rows > 0;
  if (!report.rank_deficient) return;
  std::ostringstream text;
  text << report.dependent_rows
       << " exact constraint axes depend on others or cannot move (pinned frames, fixed nodes)";
  const bool done = report.status == SolveStatus::kConverged;
  // Axes are held to the tolerance one by one.
  if (report.max_exact_error <= std::sqrt(3.0) * options_.constraint_tolerance * length_) {
    text << "; all agree with each other.";
  } else if (done) {
    text << " and contradict them: least-squares answer, largest error " << report.max_exact_error
         << " m.";
  } else {
    text << "; some are not met: largest error " << report.max_exact_error << " m.";
  }
  if (!report.message.empty()) report.message += ' ';
  report.message += text.str();
}

SolveReport Optimizer::report(SolveStatus status, int iterations, double gradient) const {
  SolveReport report;
  report.status = status;
  report.iterations = iterations;
  report.gradient = gradient;
  report.force_energy = systems_.energy(z_);
  if (rows_.count() > 0) report.constraint_energy = rows_.soft_energy(state_.residual);
  const std::vector<ConstraintRows::Miss> misses = rows_.misses(state_.residual);
  double squares = 0;
  for (const auto& miss : misses) {
    squares += miss.distance * miss.distance;
    report.max_constraint_error = std::max(report.max_constraint_error, length_ * miss.distance);
    if (miss.exact)
      report.max_exact_error = std::max(report.max_exact_error, length_ * miss.distance);
  }
  if (!misses.empty()) {
    report.rms_constraint_error = length_ * std::sqrt(squares / static_cast<double>(misses.size()));
  }
  for (const auto& miss : rows_.keyframe_misses(state_.residual))
    report.max_keyframe_error = std::max(report.max_keyframe_error, miss.distance);
  const auto& fixed = rows_.fixed();
  for (Eigen::Index i = 0; i < fixed.residual.size(); ++i) {
    if (!std::isinf(fixed.weight[i]))
      report.constraint_energy += 0.5 * fixed.weight[i] * fixed.residual[i] * fixed.residual[i];
  }
  report.total_energy = report.force_energy + report.constraint_energy;
  switch (status) {
    case SolveStatus::kConverged:
      break;
    case SolveStatus::kImproved:
      report.message = "Stopped before convergence as asked.";
      break;
    case SolveStatus::kIterationLimit:
      report.message = "Stopped at the iteration limit before convergence.";
      break;
    case SolveStatus::kStalled:
      report.message =
          "No step lowers the energy further although the gradient is above tolerance.";
      break;
    case SolveStatus::kCancelled:
      report.message = "Cancelled; the motion is the last improved one.";
      break;
  }
  if (status != SolveStatus::kImproved) say_rank(report);
  return report;
}

}  // namespace limber::spacetime
