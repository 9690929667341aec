#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/spacetime/constraint_rows.h"
#include "engine/spacetime/mode_systems.h"

namespace limber::spacetime {

/// J of the constraints' rows as its terms: what a row reads at each of its knots. Nothing else
/// needs to know that the row of a velocity has two of them.
struct RowProducts {
  const ModeSystems& systems;
  const ConstraintRows& rows;
  const Lanes& jacobian;  // lanes x terms

  /// product <- J d, one a row. @param d  lanes x kept
  void multiply(const Lanes& d, Eigen::VectorXd& product) const;
  /// product += J d over the rows of these terms.
  void add_product(const std::vector<TermBlock>& blocks, const Lanes& d,
                   Eigen::VectorXd& product) const;
  /// out += J^T m. @param m  one a row  @param out  lanes x kept
  void add_transposed(const Eigen::VectorXd& m, Lanes& out) const;
  void add_transposed(const std::vector<TermBlock>& blocks, const Eigen::VectorXd& m,
                      Lanes& out) const;
};

}  // namespace limber::spacetime
