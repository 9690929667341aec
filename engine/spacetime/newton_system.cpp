#include "engine/spacetime/newton_system.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace limber::spacetime {

void NewtonSystem::assemble(const ModeSystems& systems, const ConstraintRows& rows,
                            const Lanes& jacobian, const std::vector<Eigen::MatrixXd>& curvature,
                            const NewtonGuard& guard) {
  count_ = systems.kept_count();
  modes_ = systems.modes();
  const auto size = static_cast<std::size_t>(count_) * (kBand + 1);
  blocks_.resize(size);
  filled_.assign(size, 0);
  for (int frame = 0; frame < count_; ++frame) {
    block(frame, frame).setZero(modes_, modes_);
    block(frame, frame).diagonal().setConstant(ModeSystems::kProximal);
    filled(frame, frame) = 1;
  }
  for (const BandedRow& row : systems.rows()) {
    const int width = std::min(kBand + 1, count_ - row.start);
    for (int i = 0; i < width; ++i) {
      for (int j = 0; j <= i; ++j) {
        auto& target = block(row.start + i, row.start + j);
        if (filled(row.start + i, row.start + j) == 0) {
          target.setZero(modes_, modes_);
          filled(row.start + i, row.start + j) = 1;
        }
        target.diagonal() +=
            row.values.col(i).head(modes_).cwiseProduct(row.values.col(j).head(modes_));
      }
    }
  }
  for (int knot = 0; knot < static_cast<int>(rows.knots().size()); ++knot) {
    const int first = rows.first_row(knot), many = rows.first_row(knot + 1) - first;
    const auto columns = jacobian.topRows(modes_).middleCols(first, many);
    weighted_ = columns * rows.weight().segment(first, many).asDiagonal();
    auto& target = block(systems.kept_of_knot(knot), systems.kept_of_knot(knot));
    target.noalias() += weighted_ * columns.transpose();
    if (guard.part() > 0) target -= guard.part() * curvature[static_cast<std::size_t>(knot)];
    target.diagonal().array() += guard.shift();
  }
}

bool NewtonSystem::factor(const ModeSystems& systems, const ConstraintRows& rows,
                          const Lanes& jacobian, const std::vector<Eigen::MatrixXd>& curvature,
                          const NewtonGuard& guard) {
  assemble(systems, rows, jacobian, curvature, guard);
  for (int i = 0; i < count_; ++i) {
    for (int j = std::max(0, i - kBand); j <= i; ++j) {
      auto& target = block(i, j);
      for (int k = std::max(0, i - kBand); k < j; ++k) {
        if (j - k > kBand || filled(i, k) == 0 || filled(j, k) == 0) continue;
        if (filled(i, j) == 0) {
          target.setZero(modes_, modes_);
          filled(i, j) = 1;
        }
        if (i == j) {
          target.selfadjointView<Eigen::Lower>().rankUpdate(block(i, k), -1.0);
        } else {
          target.noalias() -= block(i, k) * block(j, k).transpose();
        }
      }
      if (filled(i, j) == 0) continue;
      if (i == j) {
        const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(target);
        if (llt.info() != Eigen::Success) return false;
      } else {
        block(j, j).triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(
            target);
      }
    }
  }
  return true;
}

void NewtonSystem::solve(Lanes& x) const {
  auto frame = [&](int i) { return x.col(i).head(modes_); };
  for (int i = 0; i < count_; ++i) {
    for (int j = std::max(0, i - kBand); j < i; ++j) {
      if (filled(i, j) != 0) frame(i).noalias() -= block(i, j) * frame(j);
    }
    auto own = frame(i);
    block(i, i).triangularView<Eigen::Lower>().solveInPlace(own);
  }
  for (int i = count_ - 1; i >= 0; --i) {
    for (int j = i + 1; j <= std::min(count_ - 1, i + kBand); ++j) {
      if (filled(j, i) != 0) frame(i).noalias() -= block(j, i).transpose() * frame(j);
    }
    auto own = frame(i);
    block(i, i).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  x.bottomRows(x.rows() - modes_).setZero();
}

}  // namespace limber::spacetime
