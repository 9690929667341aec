#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "engine/rods/solver/bordered_solver.h"
#include "engine/rods/solver/condensed_solver.h"

namespace limber::rods {

/// A linkage's Hessian H in one state, factored under the constraints there:
///
///   K = [ H  A^T ]
///       [ A   0  ]
///
/// with rows and columns of fixed unknowns those of the identity. The caller that factors writes
/// it; it is not movable, since its parts refer to each other.
struct HessianFactor {
  explicit HessianFactor(std::shared_ptr<const ChainBatches> structure)
      : solver(std::move(structure)) {}
  HessianFactor(const HessianFactor&) = delete;
  HessianFactor& operator=(const HessianFactor&) = delete;

  CondensedSolver solver;
  std::optional<BorderedSolver> bordered;  // empty: not factored, or K is singular
  std::vector<int> fixed;                  // unknowns
  Eigen::MatrixXd rows;                    // A
  double shift = 0;                        // times the solver's weights, added to H
  Eigen::VectorXd gradient;                // of the potential in that state, by all unknowns

  /// Puts constraints beside the last factor.
  void border(const Eigen::MatrixXd& constraints) {
    rows = constraints;
    bordered.emplace(solver, rows, Eigen::VectorXd::Zero(rows.rows()));
  }

  /// b <- x of K (x, .) = (b, 0), with b = 0 at fixed unknowns.
  /// @pre bordered
  void solve_in_place(Eigen::Ref<Eigen::VectorXd> b) const {
    for (const int unknown : fixed) b[unknown] = 0;
    Eigen::VectorXd forces = Eigen::VectorXd::Zero(rows.rows());
    bordered->solve_in_place(b, forces);
  }
};

}  // namespace limber::rods
