#include "engine/beams/solver/following_tangent.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/base/index.h"
#include "engine/base/rotations/exponential_map.h"
#include "engine/beams/solver/balance.h"
#include "engine/beams/structure/element_unknowns.h"

namespace limber::beams::detail {

namespace {

constexpr int kMaxFollowingIterations = 30;      // with the tangent of following loads
constexpr int kFollowingPatience = 5;            // iterations without half of the best residual
constexpr double kLargestFollowingTurn = 0.3;    // of one iteration [rad]
constexpr Eigen::Index kMaxDenseUnknowns = 600;  // free unknowns: seconds, not cancellable
constexpr double kRoundings = 4;  // times the rounding of the largest eigenvalue: below is zero

}  // namespace

FollowingTangent::FollowingTangent(const BeamStructure& structure)
    : structure_(structure), stiffness_(structure) {}

void FollowingTangent::add_loads(const BeamState& state, const NodeLoads& loads,
                                 std::vector<Eigen::Triplet<double>>& entries) const {
  const auto add = [&](int first_row, int first_column, const Eigen::Matrix3d& block) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const int row = stiffness_.row_of(first_row + i);
        const int column = stiffness_.row_of(first_column + j);
        if (row >= 0 && column >= 0) entries.emplace_back(row, column, block(i, j));
      }
    }
  };
  add_spread_loads(state, loads, entries);
  for (int i = 0; i < structure_.nodes(); ++i) {
    const Eigen::Quaterniond& turned = state.rotations[index(i)];
    const Eigen::Matrix3d to_node = structure_.node_axes(i).transpose();
    const Eigen::Matrix3d spins = structure_.spin_axes(i, turned);
    const Eigen::Vector3d force = turned * loads.following_forces.col(i);
    const Eigen::Vector3d moment = turned * loads.following_moments.col(i);
    // Spins do not commute: second derivatives along exp are the symmetric part of how moments
    // change, and so half of every moment comes off.
    const Eigen::Vector3d skew = moment - 0.5 * (moment + loads.moments.col(i));
    add(6 * i, 6 * i + 3, to_node * rotations::cross_matrix(force) * spins);
    add(6 * i + 3, 6 * i + 3, spins.transpose() * rotations::cross_matrix(skew) * spins);
  }
}

/// Loads over elements that follow, less half of their moments: see add_loads.
void FollowingTangent::add_spread_loads(const BeamState& state, const NodeLoads& loads,
                                        std::vector<Eigen::Triplet<double>>& entries) const {
  for (int e = 0; e < structure_.elements(); ++e) {
    if (loads.following_element_forces.col(e).isZero(0)) continue;
    const LoadTransfer transfer = load_transfer(structure_, e);
    const ElementEnds ends = structure_.ends(state, e);
    const SpreadLoad load = following_load(structure_, loads, ends, e);
    ElementMatrix derivative = following_derivative(transfer, ends, load);
    const ElementVector forces = spread_forces(transfer, ends, load);
    for (const int spin : {3, 9})
      derivative.block<3, 3>(spin, spin) +=
          0.5 * rotations::cross_matrix(Eigen::Vector3d(forces.segment<3>(spin)));
    const LocalMatrix change = by_unknowns(structure_, state, e, derivative);
    const ElementUnknowns unknowns = unknowns_of(structure_, e);
    for (int j = 0; j < unknowns.count; ++j) {
      const int column = stiffness_.row_of(unknowns.at[index(j)]);
      for (int i = 0; i < unknowns.count && column >= 0; ++i) {
        const int row = stiffness_.row_of(unknowns.at[index(i)]);
        if (row >= 0) entries.emplace_back(row, column, -change(i, j));
      }
    }
  }
}

FollowingTangent::Matrix FollowingTangent::full(const BeamState& state, const NodeLoads& loads) {
  stiffness_.assemble(state, loads);
  std::vector<Eigen::Triplet<double>> entries;
  const Matrix& lower = stiffness_.matrix();
  for (int column = 0; column < lower.outerSize(); ++column) {
    for (Matrix::InnerIterator entry(lower, column); entry; ++entry) {
      entries.emplace_back(static_cast<int>(entry.row()), column, entry.value());
      if (entry.row() != column)
        entries.emplace_back(column, static_cast<int>(entry.row()), entry.value());
    }
  }
  add_loads(state, loads, entries);
  Matrix result(stiffness_.size(), stiffness_.size());
  result.setFromTriplets(entries.begin(), entries.end());
  result.makeCompressed();
  return result;
}

bool FollowingTangent::factor(const BeamState& state, const NodeLoads& loads) {
  const Matrix tangent = full(state, loads);
  if (tangent.rows() == 0) return true;
  if (!tangent.coeffs().allFinite()) return false;
  factors_.compute(tangent);
  return factors_.info() == Eigen::Success;
}

std::optional<int> FollowingTangent::diverging(const BeamState& state, const NodeLoads& loads,
                                               const JobContext& context) {
  const Matrix tangent = full(state, loads);
  if (tangent.rows() == 0) return 0;
  if (!tangent.coeffs().allFinite()) return {};
  const Balance balance(structure_);
  const Eigen::VectorXd scales =
      stiffness_.restricted(balance.weights()).cwiseSqrt().cwiseInverse();
  const Matrix scaled = scales.asDiagonal() * tangent * scales.asDiagonal();
  const Matrix transposed = scaled.transpose();
  const Matrix symmetric = 0.5 * (scaled + transposed);
  Eigen::SimplicialLLT<Matrix, Eigen::Lower> positive(symmetric);
  if (positive.info() == Eigen::Success) return 0;
  context.throw_if_cancelled();
  if (scaled.rows() > kMaxDenseUnknowns) return {};
  const Eigen::MatrixXd dense(scaled);
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(dense, false);
  if (solver.info() != Eigen::Success) return {};
  const double rounding =
      1e-7 * balance.softest() + kRoundings * std::numeric_limits<double>::epsilon() * dense.norm();
  return static_cast<int>((solver.eigenvalues().real().array() < -rounding).count());
}

bool balance_following(const BeamStructure& structure, const NodeLoads& loads, double tolerance,
                       const JobContext& context, BeamState& state, BeamReport& report) {
  const Balance balance(structure);
  FollowingTangent tangent(structure);
  const auto residual = [&](const BeamState& at) -> Eigen::VectorXd {
    return elastic_gradient(structure, at) - load_vector(structure, loads, at);
  };
  const auto solve = [&](const Eigen::VectorXd& all) -> Eigen::VectorXd {
    return tangent.stiffness().extended(tangent.solve(tangent.stiffness().restricted(all)));
  };
  BeamState at = state;
  double best = std::numeric_limits<double>::infinity();
  int since = 0;
  for (int i = 0; i <= kMaxFollowingIterations && since <= kFollowingPatience; ++i) {
    context.throw_if_cancelled();
    const Eigen::VectorXd here = residual(at);
    const Imbalance left = balance.imbalance(here, balance.present(at, loads));
    if (left.scaled <= tolerance) {
      state = std::move(at);
      report.residual = left.scaled;
      report.node = -1;
      return true;
    }
    since = left.scaled < 0.5 * best ? 0 : since + 1;
    best = std::min(best, left.scaled);
    ++report.newton_iterations;
    ++report.factorizations;
    if (!tangent.factor(at, loads)) return false;
    Eigen::VectorXd step = -solve(here);
    const double size = balance.size_of(step);
    if (!std::isfinite(size)) return false;
    if (size > kLargestFollowingTurn) step *= kLargestFollowingTurn / size;
    if (size > 1e-5) {
      // Along a curve, so that slender beams keep their lengths.
      const Eigen::VectorXd bend = -solve(balance.third_derivative(residual, at, here, step));
      if (balance.size_of(bend) < 2 * kLargestFollowingTurn) step += 0.5 * bend;
    }
    at = structure.moved(at, step);
  }
  return false;
}

}  // namespace limber::beams::detail
