#include "engine/spacetime/mode_systems.h"

#include <algorithm>

#include "engine/base/error.h"

namespace limber::spacetime {
namespace {

ModeCoefficients coefficients_of(const ModeDynamics& dynamics) {
  const auto modes = dynamics.stiffness.size();
  const int lanes = padded_lanes(static_cast<int>(modes));
  ModeCoefficients coefficients{Eigen::VectorXd::Constant(lanes, -1.0),
                                Eigen::VectorXd::Ones(lanes)};
  coefficients.centre.head(modes) =
      (-2 - dynamics.damping.array() + dynamics.stiffness.array()).matrix();
  coefficients.next.head(modes) = (1 + dynamics.damping.array()).matrix();
  return coefficients;
}

}  // namespace

ModeSystems::ModeSystems(const ModeDynamics& dynamics, const Timeline& timeline)
    : modes_(static_cast<int>(dynamics.stiffness.size())),
      lanes_(padded_lanes(modes_)),
      coefficients_(coefficients_of(dynamics)),
      frames_(timeline),
      elimination_(coefficients_, frames_) {
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

void ModeSystems::append_raw_row(int centre) {
  const auto first = std::lower_bound(kept_.begin(), kept_.end(), centre - 1);
  if (first == kept_.end() || *first > centre + 1) return;
  BandedRow row{static_cast<int>(first - kept_.begin()), Lanes::Zero(lanes_, 4)};
  for (int offset = *first - (centre - 1), slot = 0; offset <= 2; ++offset, ++slot) {
    if (!frames_.contains(centre - 1 + offset)) continue;
    if (offset == 0) row.values.col(slot).setOnes();
    if (offset == 1) row.values.col(slot) = coefficients_.centre;
    if (offset == 2) row.values.col(slot) = coefficients_.next;
  }
  rows_.push_back(std::move(row));
}

void ModeSystems::set_knots(std::vector<int> knots) {
  knots_ = std::move(knots);
  kept_.clear();
  for (const int knot : knots_) {
    const bool at_end = knot == frames_.last();
    const int from = at_end && frames_.count() > 1 ? knot - 1 : knot;
    const int to = at_end ? knot : knot + 1;
    for (int frame = from; frame <= to; ++frame) {
      if (kept_.empty() || kept_.back() < frame) kept_.push_back(frame);
    }
  }
  kept_of_knot_.clear();
  for (const int knot : knots_) {
    kept_of_knot_.push_back(
        static_cast<int>(std::lower_bound(kept_.begin(), kept_.end(), knot) - kept_.begin()));
  }

  runs_.clear();
  rows_.clear();
  std::map<std::pair<int, int>, RunCost> old;
  old.swap(costs_);
  auto take_run = [&](int first, int last, int start, bool left) {
    if (first > last) return;
    runs_.push_back({first, last});
    auto known = old.extract({first, last});
    const RunCost& cost =
        known ? costs_.insert(std::move(known)).position->second
              : costs_.emplace(std::pair{first, last}, elimination_.eliminate({first, last}))
                    .first->second;
    for (int which = 0; which < 2; ++which) {
      BandedRow row{start, Lanes::Zero(lanes_, 4)};
      if (left) {
        row.values = cost.rows.middleCols(4 * which, 4);
      } else {
        row.values.leftCols(2) = cost.rows.middleCols(4 * which + 2, 2);
      }
      rows_.push_back(std::move(row));
    }
  };
  if (!kept_.empty()) {
    const int count = kept_count();
    // A raw row belongs here when no frame it touches lies in a run; its frames are kept or pinned.
    int next_centre = 1;
    auto raw_rows_until = [&](int last_centre) {
      for (; next_centre <= std::min(last_centre, frames_.frame_count() - 2); ++next_centre) {
        append_raw_row(next_centre);
      }
    };
    take_run(frames_.first(), kept_[0] - 1, 0, false);
    if (kept_[0] > frames_.first()) next_centre = std::max(1, kept_[0] + 1);
    for (int i = 0; i < count; ++i) {
      const int frame = kept_[static_cast<std::size_t>(i)];
      const int following =
          i + 1 < count ? kept_[static_cast<std::size_t>(i) + 1] : frames_.last() + 1;
      if (following == frame + 1) continue;
      raw_rows_until(frame - 1);
      take_run(frame + 1, following - 1, i - 1, true);
      next_centre = following + 1;
    }
    raw_rows_until(frames_.frame_count() - 2);
  }
  std::stable_sort(rows_.begin(), rows_.end(),
                   [](const BandedRow& a, const BandedRow& b) { return a.start < b.start; });

  factor_.factor(rows_, kept_count(), lanes_, kProximal);
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
  Eigen::MatrixXd whole;  // of a run, with the two frames on either side of it
  for (const Run& run : runs_) {
    const int from = std::max(frames.first, run.first), to = std::min(end, run.last + 1);
    if (from >= to) continue;
    const int first = run.first - 2;
    whole.setZero(modes_, run.last - run.first + 5);
    for (int i = 0; i < kept_count(); ++i) {
      const int frame = kept_[static_cast<std::size_t>(i)];
      if (frame >= first && frame <= run.last + 2)
        whole.col(frame - first) = kept.col(i).head(modes_);
    }
    elimination_.fill(run, first, whole);
    z.middleCols(from - frames.first, to - from) = whole.middleCols(from - first, to - from);
  }
  return z;
}

int ModeSystems::frames_to_fill(FrameSpan frames) const {
  int count = 0;
  for (const Run& run : runs_) {
    if (run.first < frames.first + frames.count && run.last >= frames.first)
      count += run.last - run.first + 1;
  }
  return count;
}

void ModeSystems::gather(const Eigen::MatrixXd& z, Lanes& kept) const {
  kept.setZero(lanes_, kept_count());
  for (int i = 0; i < kept_count(); ++i)
    kept.col(i).head(modes_) = z.col(kept_[static_cast<std::size_t>(i)]);
}

}  // namespace limber::spacetime
