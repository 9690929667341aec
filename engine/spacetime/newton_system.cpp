#include "engine/spacetime/newton_system.h"

namespace limber::spacetime {

/// The part of J^T W J between the two knots of a row.
void NewtonSystem::tie_knots(int modes, const ConstraintRows& rows, const Lanes& jacobian) {
  ties_.clear();
  for (const TermPair& pair : rows.pairs()) {
    const int knot = rows.knot_of(pair.first), later = rows.knot_of(pair.second);
    // Axes of one velocity follow each other.
    if (ties_.empty() || ties_.back().knot != knot || ties_.back().later != later)
      ties_.push_back({knot, later, Eigen::MatrixXd::Zero(modes, modes)});
    ties_.back().block.noalias() += term_weight_[pair.first] *
                                    jacobian.col(pair.second).head(modes) *
                                    jacobian.col(pair.first).head(modes).transpose();
  }
}

bool NewtonSystem::factor(const ModeSystems& systems, const ConstraintRows& rows,
                          const Lanes& jacobian, const std::vector<Eigen::MatrixXd>& curvature,
                          const NewtonGuard& guard) {
  return factor_with(systems, rows, jacobian, [&](int knot, Eigen::Ref<Eigen::MatrixXd> block) {
    if (guard.part() > 0) block -= guard.part() * curvature[static_cast<std::size_t>(knot)];
    block.diagonal().array() += guard.shift();
  });
}

bool NewtonSystem::factor_first_order(const ModeSystems& systems, const ConstraintRows& rows,
                                      const Lanes& jacobian) {
  return factor_with(systems, rows, jacobian, [](int, const Eigen::Ref<Eigen::MatrixXd>&) {});
}

void NewtonSystem::saddle(const ConstraintRows& rows, const RowProducts& products,
                          const Eigen::VectorXd& c, Lanes& d, Eigen::VectorXd& m) {
  m = rows.weight().cwiseProduct(c);
  products.add_transposed(m, d);
  solve(d);
  products.multiply(d, along_);
  m -= rows.weight().cwiseProduct(along_);
}

bool NewtonSystem::factor_with(const ModeSystems& systems, const ConstraintRows& rows,
                               const Lanes& jacobian, const Curve& curve) {
  term_weight_.resize(rows.term_count());
  for (int term = 0; term < rows.term_count(); ++term)
    term_weight_[term] = rows.weight()[rows.row_of(term)];
  const auto add_block = [&](int knot, Eigen::Ref<Eigen::MatrixXd> block) {
    const int first = rows.first_term(knot), many = rows.first_term(knot + 1) - first;
    const auto columns = jacobian.topRows(systems.modes()).middleCols(first, many);
    weighted_ = columns * term_weight_.segment(first, many).asDiagonal();
    block.noalias() += weighted_ * columns.transpose();
    curve(knot, block);
  };
  tie_knots(systems.modes(), rows, jacobian);
  return system_.factor(systems, add_block, ties_);
}

}  // namespace limber::spacetime
