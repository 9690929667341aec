#include "engine/spacetime/block_system.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace limber::spacetime {

Eigen::Index BlockSystem::place(int frame) const {
  const int group = group_of_[static_cast<std::size_t>(frame)];
  return Eigen::Index{modes_} * (frame - first_[static_cast<std::size_t>(group)]);
}

void BlockSystem::group_frames(const ModeSystems& systems, const std::vector<Tie>& ties) {
  const int count = systems.kept_count();
  // In a cycle these are one group, the last.
  const bool is_cycle = systems.shape() == Shape::kCycle;
  const int border = count - (is_cycle ? systems.width() / 2 : 0);
  // The last frame that each one, or one before it, couples to.
  std::vector<int> reach(static_cast<std::size_t>(count));
  for (int frame = 0; frame < count; ++frame) reach[static_cast<std::size_t>(frame)] = frame;
  for (const BandedRow& row : systems.rows()) {
    const int last = std::min(count, row.start + static_cast<int>(row.values.cols())) - 1;
    auto& known = reach[static_cast<std::size_t>(row.start)];
    known = std::max(known, last);
  }
  for (const Tie& tie : ties) {
    const int later = systems.kept_of_knot(tie.later);
    if (is_cycle && later >= border) continue;
    auto& known = reach[static_cast<std::size_t>(systems.kept_of_knot(tie.knot))];
    known = std::max(known, later);
  }
  for (std::size_t frame = 1; frame < reach.size(); ++frame) {
    reach[frame] = std::max(reach[frame], reach[frame - 1]);
  }
  first_.assign(1, 0);
  group_of_.clear();
  while (first_.back() < count) {
    const int begin = first_.back();
    const int needed = begin > 0 ? reach[static_cast<std::size_t>(begin) - 1] + 1 : 0;
    int end = std::min(count, std::max(begin + 2, needed));
    if (is_cycle && end > border) end = count;
    first_.push_back(end);
    group_of_.resize(static_cast<std::size_t>(first_.back()), group_count() - 1);
  }
}

/// The products with what a row reads of the last frames. These may be the first ones, too.
template <class Block>
void BlockSystem::add_over_seam(const BandedRow& row, int width, int count, const Block& block) {
  const auto many = static_cast<int>(row.behind.cols());
  const auto add = [&](int frame, const auto& of_frame, int other, const auto& of_other) {
    block(std::max(frame, other), std::min(frame, other)).diagonal() +=
        of_frame.head(modes_).cwiseProduct(of_other.head(modes_));
  };
  for (int i = 0; i < many; ++i) {
    const int frame = count - many + i;
    for (int j = 0; j <= i; ++j) add(frame, row.behind.col(i), count - many + j, row.behind.col(j));
    for (int j = 0; j < width; ++j) {
      const int other = row.start + j;
      add(frame, row.behind.col(i), other, row.values.col(j));
      if (other == frame) add(frame, row.behind.col(i), other, row.values.col(j));
    }
  }
}

void BlockSystem::assemble(const ModeSystems& systems, const AddBlock& add_block,
                           const std::vector<Tie>& ties) {
  const int count = systems.kept_count();
  modes_ = systems.modes();
  group_frames(systems, ties);
  const auto groups = static_cast<std::size_t>(group_count());
  diagonal_.resize(groups);
  below_.resize(groups);
  arrow_.assign(groups, {});
  const auto size = [&](std::size_t group) {
    return group < groups ? Eigen::Index{modes_} * (first_[group + 1] - first_[group]) : 0;
  };
  for (std::size_t group = 0; group < groups; ++group) {
    diagonal_[group].setZero(size(group), size(group));
    diagonal_[group].diagonal().setConstant(ModeSystems::kProximal);
    below_[group].setZero(size(group + 1), size(group));
    if (systems.shape() == Shape::kCycle && group + 2 < groups)
      arrow_[group].setZero(size(groups - 1), size(group));
  }
  // The block of a frame and an earlier one, or of the frame and itself.
  const auto block = [&](int frame, int other) {
    const auto group = static_cast<std::size_t>(group_of_[static_cast<std::size_t>(other)]);
    const int apart = group_of_[static_cast<std::size_t>(frame)] - static_cast<int>(group);
    auto& target = apart == 0 ? diagonal_[group] : apart == 1 ? below_[group] : arrow_[group];
    return target.block(place(frame), place(other), modes_, modes_);
  };
  for (const BandedRow& row : systems.rows()) {
    const int width = std::min(static_cast<int>(row.values.cols()), count - row.start);
    for (int i = 0; i < width; ++i) {
      for (int j = 0; j <= i; ++j) {
        block(row.start + i, row.start + j).diagonal() +=
            row.values.col(i).head(modes_).cwiseProduct(row.values.col(j).head(modes_));
      }
    }
    add_over_seam(row, width, count, block);
  }
  for (int knot = 0; knot < static_cast<int>(systems.knots().size()); ++knot) {
    const int frame = systems.kept_of_knot(knot);
    add_block(knot, block(frame, frame));
  }
  for (const Tie& tie : ties)
    block(systems.kept_of_knot(tie.later), systems.kept_of_knot(tie.knot)) += tie.block;
}

bool BlockSystem::factor(const ModeSystems& systems, const AddBlock& add_block,
                         const std::vector<Tie>& ties) {
  assemble(systems, add_block, ties);
  const auto groups = static_cast<std::size_t>(group_count());
  for (std::size_t group = 0; group < groups; ++group) {
    auto& own = diagonal_[group];
    if (group > 0) own.selfadjointView<Eigen::Lower>().rankUpdate(below_[group - 1], -1.0);
    if (group > 0 && has_arrow(group - 1)) {
      auto& beyond = group + 2 < groups ? arrow_[group] : below_[group];
      beyond.noalias() -= arrow_[group - 1] * below_[group - 1].transpose();
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(own);
    if (llt.info() != Eigen::Success) return false;
    if (group + 1 == groups) continue;
    const auto upper = own.triangularView<Eigen::Lower>().transpose();
    upper.solveInPlace<Eigen::OnTheRight>(below_[group]);
    if (!has_arrow(group)) continue;
    upper.solveInPlace<Eigen::OnTheRight>(arrow_[group]);
    diagonal_.back().selfadjointView<Eigen::Lower>().rankUpdate(arrow_[group], -1.0);
  }
  return true;
}

void BlockSystem::solve(Lanes& x) const {
  const auto groups = static_cast<std::size_t>(group_count());
  const Eigen::Index count = first_.back();
  x_ = x.topRows(modes_).leftCols(count).reshaped();
  const auto part = [&](std::size_t group) {
    return x_.segment(Eigen::Index{modes_} * first_[group],
                      Eigen::Index{modes_} * (first_[group + 1] - first_[group]));
  };
  for (std::size_t group = 0; group < groups; ++group) {
    auto own = part(group);
    if (group > 0) own.noalias() -= below_[group - 1] * part(group - 1);
    diagonal_[group].triangularView<Eigen::Lower>().solveInPlace(own);
    if (has_arrow(group)) part(groups - 1).noalias() -= arrow_[group] * own;
  }
  for (std::size_t group = groups; group-- > 0;) {
    auto own = part(group);
    if (group + 1 < groups) own.noalias() -= below_[group].transpose() * part(group + 1);
    if (has_arrow(group)) own.noalias() -= arrow_[group].transpose() * part(groups - 1);
    diagonal_[group].triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  x.setZero();
  x.topRows(modes_).leftCols(count) = x_.reshaped(modes_, count);
}

void BlockSystem::half_solve(Eigen::MatrixXd& x, const std::vector<int>& starts) const {
  std::size_t begun = 0;
  for (std::size_t group = 0; group < static_cast<std::size_t>(group_count()); ++group) {
    while (begun < starts.size() && starts[begun] < first_[group + 1]) ++begun;
    const auto rows = [&](std::size_t of) {
      return x.block(Eigen::Index{modes_} * first_[of], 0,
                     Eigen::Index{modes_} * (first_[of + 1] - first_[of]),
                     static_cast<Eigen::Index>(begun));
    };
    auto own = rows(group);
    if (group > 0) own.noalias() -= below_[group - 1] * rows(group - 1);
    diagonal_[group].triangularView<Eigen::Lower>().solveInPlace(own);
    if (has_arrow(group))
      rows(static_cast<std::size_t>(group_count()) - 1).noalias() -= arrow_[group] * own;
  }
}

}  // namespace limber::spacetime
