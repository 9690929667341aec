#include "engine/bodies/lanczos.h"

#include <Spectra/SymGEigsShiftSolver.h>
#include <fmt/format.h>

#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/random.h"

namespace limber::bodies {
namespace {

/// b -> unit * P (K + s M)^-1 b, with unit such that the eigenvalues are of order 1: Spectra
/// compares with absolute thresholds.
class SolveOperator {
 public:
  using Scalar = double;
  SolveOperator(const ShiftInvert& op, double unit, int expected_solves, const JobContext& job)
      : op_(op), unit_(unit), expected_solves_(expected_solves), job_(job) {}
  [[nodiscard]] Eigen::Index rows() const { return op_.size(); }
  [[nodiscard]] Eigen::Index cols() const { return op_.size(); }
  void set_shift(double) {}  // fixed by ShiftInvert
  void perform_op(const double* in, double* out) {
    const double done = ++solves_;
    job_.report("modes", std::min(1.0, done / expected_solves_));
    Eigen::Map<Eigen::VectorXd> result(out, op_.size());
    result = unit_ * Eigen::Map<const Eigen::VectorXd>(in, op_.size());
    op_.solve_in_place(result, workspace_);
  }

 private:
  const ShiftInvert& op_;
  double unit_;
  int expected_solves_;
  const JobContext& job_;
  int solves_ = 0;
  SparseCholesky::Workspace workspace_;
};

class MassOperator {
 public:
  using Scalar = double;
  explicit MassOperator(const ShiftInvert& op) : op_(op) {}
  [[nodiscard]] Eigen::Index rows() const { return op_.size(); }
  [[nodiscard]] Eigen::Index cols() const { return op_.size(); }
  void perform_op(const double* in, double* out) const {
    Eigen::Map<Eigen::VectorXd>(out, op_.size()).noalias() =
        op_.mass() * Eigen::Map<const Eigen::VectorXd>(in, op_.size());
  }

 private:
  const ShiftInvert& op_;
};

}  // namespace

Eigen::MatrixXd lanczos_modes(const ShiftInvert& op, int count, int largest_subspace,
                              double tolerance, int max_restarts, const JobContext& job) {
  const double unit = op.first_eigenvalue() + op.shift();
  const int subspace = std::min(largest_subspace, 3 * count / 2 + 20);
  LIMBER_DEMAND(count > 0 && count < subspace);
  SolveOperator solve(op, unit, 3 * subspace / 2, job);
  MassOperator mass(op);
  Spectra::SymGEigsShiftSolver<SolveOperator, MassOperator, Spectra::GEigsMode::ShiftInvert> solver(
      solve, mass, count, subspace, 0.0);

  Random random(2);
  Eigen::VectorXd start(op.size());
  for (double& entry : start) entry = random.uniform(-1, 1);
  op.project(start);
  solver.init(start.data());
  const auto converged = solver.compute(Spectra::SortRule::LargestMagn, max_restarts, tolerance,
                                        Spectra::SortRule::SmallestAlge);
  if (solver.info() != Spectra::CompInfo::Successful) {
    throw Error(
        ErrorCode::kNumerical, "mode_count",
        fmt::format("Lanczos found {} of {} modes in {} restarts", converged, count, max_restarts));
  }
  return solver.eigenvectors();
}

}  // namespace limber::bodies
