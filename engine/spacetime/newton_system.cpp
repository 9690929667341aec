#include "engine/spacetime/newton_system.h"

namespace limber::spacetime {

bool NewtonSystem::factor(const ModeSystems& systems, const ConstraintRows& rows,
                          const Lanes& jacobian, const std::vector<Eigen::MatrixXd>& curvature,
                          const NewtonGuard& guard) {
  const auto add_block = [&](int knot, Eigen::Ref<Eigen::MatrixXd> block) {
    const int first = rows.first_row(knot), many = rows.first_row(knot + 1) - first;
    const auto columns = jacobian.topRows(systems.modes()).middleCols(first, many);
    weighted_ = columns * rows.weight().segment(first, many).asDiagonal();
    block.noalias() += weighted_ * columns.transpose();
    if (guard.part() > 0) block -= guard.part() * curvature[static_cast<std::size_t>(knot)];
    block.diagonal().array() += guard.shift();
  };
  return system_.factor(systems, add_block);
}

}  // namespace limber::spacetime
