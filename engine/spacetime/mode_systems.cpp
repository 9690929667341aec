#include "engine/spacetime/mode_systems.h"

#include <algorithm>

#include "engine/base/error.h"

namespace limber::spacetime {
ModeSystems::ModeSystems(const ModeDynamics& dynamics, const Timeline& timeline)
    : modes_(static_cast<int>(dynamics.stiffness.size())),
      lanes_(padded_lanes(modes_)),
      force_rows_(dynamics, timeline.frame_count, beginning_of(timeline)),
      frames_(timeline),
      elimination_(force_rows_, frames_) {
  LIMBER_DEMAND(frames_.count() >= 1);
}

const GreenBlocks& ModeSystems::green() const {
  if (!green_known_) green_.compute(factor_, kept_count(), lanes_, kept_of_knot_);
  green_known_ = true;
  return green_;
}

void ModeSystems::response(int knot, Eigen::VectorXd& own) const {
  factor_.inverse_diagonal(kept_of_knot(knot), own);
}

/// @param columns  lanes x width: the last kept frames, then the first ones
void ModeSystems::append_over_seam(const Lanes& columns) {
  const int reach = force_rows_.reach();
  BandedRow row{0, Lanes::Zero(lanes_, width()), columns.leftCols(reach)};
  row.values.leftCols(reach) = columns.rightCols(reach);
  rows_.push_back(std::move(row));
}

void ModeSystems::append_raw_row(int row) {
  const int reach = force_rows_.reach();
  if (frames_.is_cyclic() && row + reach >= frames_.frame_count()) {
    Lanes columns = Lanes::Zero(lanes_, width());
    for (int term = 0; term <= reach; ++term) {
      const int column = row + term - frames_.frame_count() + reach;
      std::copy_n(force_rows_.coefficient(row, term), lanes_, columns.col(column).data());
    }
    return append_over_seam(columns);
  }
  const auto first = std::lower_bound(kept_.begin(), kept_.end(), row);
  if (first == kept_.end() || *first > row + reach) return;
  BandedRow banded{static_cast<int>(first - kept_.begin()), Lanes::Zero(lanes_, width())};
  for (int term = *first - row, slot = 0; term <= reach; ++term, ++slot) {
    if (!frames_.contains(row + term)) continue;
    std::copy_n(force_rows_.coefficient(row, term), lanes_, banded.values.col(slot).data());
  }
  rows_.push_back(std::move(banded));
}

/// @param start  kept frame of the cost's first column; negative: nothing is kept before the run
void ModeSystems::append_run(Run run, const RunCost& cost, int start) {
  runs_.push_back(run);
  const int reach = force_rows_.reach();
  for (int which = 0; which < reach; ++which) {
    BandedRow row{std::max(start, 0), Lanes::Zero(lanes_, width())};
    const auto columns = cost.rows.middleCols(width() * which, width());
    if (frames_.is_cyclic() && run.last >= frames_.frame_count() - 1) {
      append_over_seam(columns);
      continue;
    }
    if (start >= 0) {
      row.values = columns;
    } else {
      row.values.leftCols(reach) = columns.rightCols(reach);
    }
    rows_.push_back(std::move(row));
  }
}

void ModeSystems::keep_frames() {
  const int beside = force_rows_.reach() - 1;
  kept_.clear();
  for (const int knot : knots_) {
    const int from = std::max(frames_.first(), std::min(knot, frames_.last() - beside));
    const int to = std::min(frames_.last(), from + beside);
    for (int frame = from; frame <= to; ++frame) {
      if (kept_.empty() || kept_.back() < frame) kept_.push_back(frame);
    }
  }
  kept_of_knot_.clear();
  for (const int knot : knots_) {
    kept_of_knot_.push_back(
        static_cast<int>(std::lower_bound(kept_.begin(), kept_.end(), knot) - kept_.begin()));
  }
}

void ModeSystems::set_knots(std::vector<int> knots) {
  knots_ = std::move(knots);
  keep_frames();
  runs_.clear();
  rows_.clear();
  std::map<std::pair<int, int>, RunCost> old;
  old.swap(costs_);
  auto take_run = [&](int first, int last, int start) {
    if (first > last) return;
    auto known = old.extract({first, last});
    const RunCost& cost =
        known ? costs_.insert(std::move(known)).position->second
              : costs_.emplace(std::pair{first, last}, elimination_.eliminate({first, last}))
                    .first->second;
    append_run({first, last}, cost, start);
  };
  if (!kept_.empty()) {
    const int count = kept_count(), reach = force_rows_.reach();
    // A raw row belongs here when no frame it touches lies in a run; its frames are kept or pinned.
    int next_row = force_rows_.first();
    auto raw_rows_until = [&](int last_row) {
      for (; next_row <= std::min(last_row, force_rows_.last()); ++next_row)
        append_raw_row(next_row);
    };
    const int end = frames_.is_cyclic() ? kept_[0] + frames_.frame_count() : frames_.last() + 1;
    if (!frames_.is_cyclic()) take_run(frames_.first(), kept_[0] - 1, -1);
    if (kept_[0] > frames_.first()) next_row = kept_[0];
    for (int i = 0; i < count; ++i) {
      const int frame = kept_[static_cast<std::size_t>(i)];
      const int following = i + 1 < count ? kept_[static_cast<std::size_t>(i) + 1] : end;
      if (following == frame + 1) continue;
      raw_rows_until(frame - reach);
      take_run(frame + 1, following - 1, i + 1 - reach);
      next_row = following;
    }
    raw_rows_until(force_rows_.last());
  }
  std::stable_sort(rows_.begin(), rows_.end(),
                   [](const BandedRow& a, const BandedRow& b) { return a.start < b.start; });

  factor_.factor(rows_, width(), kept_count(), lanes_, kProximal, shape());
  green_known_ = false;
}

void ModeSystems::interpolate(const Lanes& kept, Eigen::MatrixXd& z) const {
  z.resize(modes_, frames_.frame_count());
  if (kept_.empty()) {
    z.setZero();
    return;
  }
  z.leftCols(frames_.first()).setZero();
  z.rightCols(frames_.frame_count() - 1 - frames_.last()).setZero();
  for (int i = 0; i < kept_count(); ++i)
    z.col(kept_[static_cast<std::size_t>(i)]) = kept.col(i).head(modes_);
  for (const Run& run : runs_) elimination_.fill(run, 0, z);
}

Eigen::MatrixXd ModeSystems::interpolate(const Lanes& kept, FrameSpan frames) const {
  Eigen::MatrixXd z = Eigen::MatrixXd::Zero(modes_, frames.count);
  const int end = frames.first + frames.count;
  for (int i = 0; i < kept_count(); ++i) {
    const int frame = kept_[static_cast<std::size_t>(i)];
    if (frame >= frames.first && frame < end)
      z.col(frame - frames.first) = kept.col(i).head(modes_);
  }
  if (kept_.empty()) return z;
  const int reach = force_rows_.reach();
  Eigen::MatrixXd whole;  // of a run, with `reach` frames on either side of it
  for (const Run& run : runs_) {
    // A run over the seam has frames at both ends of the motion.
    for (int turn = 0; turn <= run.last; turn += frames_.frame_count()) {
      const int from = std::max(frames.first + turn, run.first),
                to = std::min(end + turn, run.last + 1);
      if (from >= to) continue;
      const int first = run.first - reach;
      whole.setZero(modes_, run.last - run.first + 1 + 2 * reach);
      for (int column = 0; column < whole.cols(); ++column) {
        const auto place =
            std::lower_bound(kept_.begin(), kept_.end(), frames_.within(first + column));
        if (place != kept_.end() && *place == frames_.within(first + column))
          whole.col(column) = kept.col(place - kept_.begin()).head(modes_);
      }
      elimination_.fill(run, first, whole);
      z.middleCols(from - turn - frames.first, to - from) =
          whole.middleCols(from - first, to - from);
    }
  }
  return z;
}

int ModeSystems::frames_to_fill(FrameSpan frames) const {
  int count = 0;
  for (const Run& run : runs_) {
    const bool is_asked = (run.first < frames.first + frames.count && run.last >= frames.first) ||
                          run.last >= frames.first + frames_.frame_count();
    if (is_asked) count += run.last - run.first + 1;
  }
  return count;
}

void ModeSystems::gather(const Eigen::MatrixXd& z, Lanes& kept) const {
  kept.setZero(lanes_, kept_count());
  for (int i = 0; i < kept_count(); ++i)
    kept.col(i).head(modes_) = z.col(kept_[static_cast<std::size_t>(i)]);
}

}  // namespace limber::spacetime
