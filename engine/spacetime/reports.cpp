#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "engine/spacetime/optimizer.h"

#include "engine/base/numerics/dense.h"

namespace limber::spacetime {
namespace {

/// Exact rows that may depend on each other: those of one frame, and of frames that the rows of
/// velocities among them tie together. No z is excluded, only costly, so frames that no row couples
/// never do.
struct TiedRows {
  std::vector<int> rows;       // ascending
  Eigen::MatrixXd transposed;  // J^T of these over the z of their knots
};

/// A pivoted QR of m x n takes about 2 m n^2 operations and cannot be interrupted. If a group of
/// rows that velocities couple needs more than this (0.3 s), its dependence is not checked.
constexpr double kMaxOperations = 2e8;

struct TiedGroups {
  std::vector<TiedRows> groups;
  bool are_all = true;  // false: some were too large to be looked at
};

TiedGroups tied_exact_rows(const ConstraintRows& rows, const Lanes& jacobian) {
  const auto knots = rows.knots().size();
  std::vector<std::size_t> group(knots);  // the first knot that each is tied to, itself if none
  for (std::size_t knot = 0; knot < knots; ++knot) group[knot] = knot;
  for (const TermPair& pair : rows.pairs()) {
    if (!rows.exact(rows.row_of(pair.first))) continue;
    const std::size_t a = group[static_cast<std::size_t>(rows.knot_of(pair.first))];
    const std::size_t b = group[static_cast<std::size_t>(rows.knot_of(pair.second))];
    std::replace(group.begin(), group.end(), std::max(a, b), std::min(a, b));
  }
  std::vector<std::vector<int>> groups(knots);
  for (std::size_t knot = 0; knot < knots; ++knot)
    groups[group[knot]].push_back(static_cast<int>(knot));
  TiedGroups found;
  for (const std::vector<int>& members : groups) {
    TiedRows tied;
    for (const int knot : members) {
      for (int term = rows.first_term(knot); term < rows.first_term(knot + 1); ++term)
        if (rows.exact(rows.row_of(term))) tied.rows.push_back(rows.row_of(term));
    }
    if (tied.rows.empty()) continue;
    std::sort(tied.rows.begin(), tied.rows.end());
    tied.rows.erase(std::unique(tied.rows.begin(), tied.rows.end()), tied.rows.end());
    const auto count = static_cast<double>(tied.rows.size());
    const auto unknowns =
        static_cast<double>(jacobian.rows()) * static_cast<double>(members.size());
    if (members.size() > 1 && unknowns * count * count > kMaxOperations) {
      found.are_all = false;
      continue;
    }
    tied.transposed.setZero(jacobian.rows() * static_cast<Eigen::Index>(members.size()),
                            static_cast<Eigen::Index>(tied.rows.size()));
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (int term = rows.first_term(members[i]); term < rows.first_term(members[i] + 1); ++term) {
        if (!rows.exact(rows.row_of(term))) continue;
        const auto at = std::lower_bound(tied.rows.begin(), tied.rows.end(), rows.row_of(term));
        tied.transposed.block(jacobian.rows() * static_cast<Eigen::Index>(i),
                              at - tied.rows.begin(), jacobian.rows(), 1) = jacobian.col(term);
      }
    }
    found.groups.push_back(std::move(tied));
  }
  return found;
}

/// Dependence is a matter of the pivots of J J^T, as squares of those of a pivoted QR of J^T.
struct TiedRank {
  PivotedQr qr;
  Eigen::Index rank = 0;
};

TiedRank rank_of(const Eigen::MatrixXd& transposed, double tolerance) {
  TiedRank result{pivoted_qr(transposed), 0};
  const auto pivots = result.qr.r.diagonal();
  for (Eigen::Index i = 0; i < pivots.size(); ++i) {
    if (pivots[i] != 0 && pivots[i] * pivots[i] > tolerance * pivots[0] * pivots[0]) ++result.rank;
  }
  return result;
}

std::string largest_error(const SolveReport& report) {
  std::ostringstream text;
  text << "largest error " << report.max_exact_error << " m";
  if (report.max_exact_velocity_error > 0)
    text << ", " << report.max_exact_velocity_error << " m per frame";
  text << '.';
  return text.str();
}

}  // namespace

bool Optimizer::only_contradiction_left() const {
  if (state_.jacobian.cols() != rows_.term_count()) return false;
  bool deficient = false;
  // Contradiction times a heavy weight is what the merit then consists of: smaller errors than this
  // no longer show in it.
  const double resolvable = std::sqrt(kRounding * merit(z_, state_) / rows_.exact_weight());
  const double tolerance = std::max(options_.constraint_tolerance, resolvable);
  const TiedGroups tied = tied_exact_rows(rows_, state_.jacobian);
  if (!tied.are_all) return false;
  for (const auto& [rows, transposed] : tied.groups) {
    Eigen::VectorXd residual(static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i)
      residual[static_cast<Eigen::Index>(i)] = state_.residual[rows[i]];
    if (residual.cwiseAbs().maxCoeff() <= tolerance) continue;
    const TiedRank frame = rank_of(transposed, options_.rank_tolerance);
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
  if (rows_.exact_count() > 0 && state_.jacobian.cols() == rows_.term_count()) {
    for (const auto& [rows, transposed] : tied_exact_rows(rows_, state_.jacobian).groups) {
      report.dependent_rows += static_cast<int>(static_cast<Eigen::Index>(rows.size()) -
                                                rank_of(transposed, options_.rank_tolerance).rank);
    }
  }
  report.rank_deficient = report.dependent_rows > 0;
  if (!report.rank_deficient) return;
  std::ostringstream text;
  text << report.dependent_rows
       << " exact constraint axes depend on others or cannot move (pinned frames, fixed nodes)";
  const bool done = report.status == SolveStatus::kConverged;
  // Axes are held to the tolerance one by one.
  if (report.exact_error() <= std::sqrt(3.0) * options_.constraint_tolerance * length_) {
    text << "; all agree with each other.";
  } else if (done) {
    text << " and contradict them: least-squares answer, " << largest_error(report);
  } else {
    text << "; some are not met: " << largest_error(report);
  }
  if (!report.message.empty()) report.message += ' ';
  report.message += text.str();
}

SolveReport Optimizer::report(SolveStatus status, int iterations, double gradient) const {
  SolveReport report;
  report.status = status;
  report.iterations = iterations;
  report.gradient = gradient;
  report.force_energy = systems_.energy(z_) + passive_.energy;
  if (rows_.count() > 0) report.constraint_energy = rows_.soft_energy(state_.residual);
  static_cast<ConstraintErrors&>(report) = rows_.errors(state_.residual);
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
      report.message = "Stopped before convergence as requested.";
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
  if (status == SolveStatus::kImproved) return report;
  constexpr double kFarMissed = 0.5, kVisiblyMissed = 1e-3;  // shares of the body's length
  report.missed =
      rows_.missed_positions(state_.residual, kFarMissed * length_, kVisiblyMissed * length_);
  say_rank(report);
  return report;
}

SolveReport Optimizer::report_given_up(int iterations, double gradient) const {
  if (residual_valid_) return report(SolveStatus::kImproved, iterations, gradient);
  SolveReport report;
  report.status = SolveStatus::kImproved;
  report.iterations = iterations;
  report.force_energy = report.constraint_energy = report.total_energy =
      std::numeric_limits<double>::infinity();
  report.message = "Given up before the constraints were evaluated.";
  return report;
}

}  // namespace limber::spacetime
