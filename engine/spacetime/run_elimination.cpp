#include "engine/spacetime/run_elimination.h"

#include <cmath>
#include <utility>

#include "engine/spacetime/lane_turn.h"

namespace limber::spacetime {
namespace {

/// A free end lets a mode continue without force. This may multiply the motion by more than
/// e^kExplosive over the run: if lambda > 4 (the time step is too long for the mode), or with
/// damping read backwards. The optimum of (17a) is then a useless motion, finally one beyond double
/// precision. Therefore the run's last frames are held at zero for that mode.
constexpr double kExplosive = 1.3862943611198906;  // log 4

/// Takes frame j out of the carried rows, kLaneWidth lanes, by the row that begins with it. Carried
/// rows are over (l1 .. lm, j .. j + m - 1), afterwards over (l1 .. lm, j + 1 .. j + m). Row p is
/// zero behind its (p + 1)th frame of the run.
/// @param fresh  m + 1 numbers of the row that begins with j; @param is_row  1 or 0: there is none
/// @param carried, recovered  m rows of 2 m numbers; e1 .. em f1 .. fm; each `stride` apart
template <int kReach>
inline void take_out_frame(const LanePacket (&fresh)[kReach + 1], double is_row, double* carried,
                           double* recovered, Eigen::Index stride) {
  constexpr int kWidth = 2 * kReach;
  // The first row ends as that of frame j: in turn all others lose the frame to it.
  LanePacket own[kWidth + 1], kept[kReach][kWidth];
  unrolled<kWidth + 1>([&](auto c) {
    if constexpr (c <= kReach) {
      own[c] = load_lanes(carried + c * stride);
    } else {
      own[c].setZero();
    }
  });
  unrolled<kReach - 1>([&](auto before) {
    constexpr int kRow = before + 1, kNumbers = kReach + kRow + 1;
    LanePacket other[kNumbers];
    unrolled<kNumbers>(
        [&](auto c) { other[c] = load_lanes(carried + (kWidth * kRow + c) * stride); });
    const LaneTurn turn(own[kReach], other[kReach]);
    unrolled<kNumbers>([&](auto c) {
      if constexpr (c != kReach) {
        constexpr int kTarget = c < kReach ? c : c - 1;
        kept[kRow - 1][kTarget] = turn.cosine * other[c] - turn.sine * own[c];
        own[c] = turn.cosine * own[c] + turn.sine * other[c];
      }
    });
    own[kReach] = turn.length;
  });
  const LaneTurn turn(own[kReach], fresh[0]);
  const LanePacket by_own = -turn.inverse * turn.cosine, by_fresh = -turn.inverse * turn.sine;
  unrolled<kReach>([&](auto c) {
    constexpr int kBehind = c + 1;
    store_lanes(by_own * own[kReach + kBehind] + by_fresh * fresh[kBehind], recovered + c * stride);
    store_lanes(by_own * own[c], recovered + (kReach + c) * stride);
    kept[kReach - 1][c] = -turn.sine * own[c];
    kept[kReach - 1][kReach + c] = turn.cosine * fresh[kBehind] - turn.sine * own[kReach + kBehind];
  });
  // A frame held at zero at the last end needs no elimination and brings no row. The part of the
  // carried rows in the frames before the run stays a cost.
  const LanePacket stays = (1 - is_row) * turn.is_zero, goes = 1 - stays;
  unrolled<kReach>([&](auto p) {
    unrolled<kReach + p + 1>([&](auto c) {
      double* place = carried + (kWidth * p + c) * stride;
      LanePacket value = goes * kept[p][c];
      if constexpr (c < kReach) value += stays * load_lanes(place);
      store_lanes(value, place);
    });
  });
}

}  // namespace

std::optional<int> pinned_frames(EndCondition end) {
  switch (end) {
    case EndCondition::kFree:
    case EndCondition::kCyclic:
      return 0;
    case EndCondition::kPinnedPosition:
      return 1;
    case EndCondition::kPinnedPositionVelocity:
      return 2;
  }
  return std::nullopt;
}

FreeFrames::FreeFrames(const Timeline& timeline)
    : frame_count_(timeline.frame_count),
      first_(pinned_frames(timeline.first).value_or(0)),
      last_(timeline.frame_count - 1 - pinned_frames(timeline.last).value_or(0)),
      is_cyclic_(timeline.is_cyclic()) {}

RunElimination::RunElimination(ForceRows rows, const FreeFrames& frames)
    : rows_(std::move(rows)), frames_(frames) {
  const Eigen::Index lanes = rows_.lanes();
  memory_.assign(static_cast<std::size_t>(frames.frame_count()) * 2 *
                     static_cast<std::size_t>(rows_.reach()) * static_cast<std::size_t>(lanes),
                 0.0);
  none_ = Eigen::VectorXd::Zero(lanes);
  all_ = Eigen::VectorXd::Ones(lanes);
  for (auto* growth : {&forward_[0], &forward_[1], &backward_[0], &backward_[1]})
    growth->resize(lanes);
  for (Eigen::Index k = 0; k < lanes; ++k) {
    const FreeGrowth growth = rows_.growth(static_cast<int>(k));
    forward_[0][k] = growth.larger;
    forward_[1][k] = growth.smaller;
    // Read backwards, damping lets modes grow, unless their first frames have a cost.
    backward_[0][k] = rows_.begins_from_rest() ? 0 : -growth.smaller;
    backward_[1][k] = rows_.begins_from_rest() ? 0 : -growth.larger;
  }
}

const double* RunElimination::allowed(Run run, int frame) {
  if (frames_.is_cyclic()) return all_.data();
  if (!frames_.contains(frame)) return none_.data();
  const int from_end = frames_.frame_count() - 1 - frame;
  const bool near_first = frame < 2 && run.first == frames_.first() && run.last < frames_.last();
  const bool near_last = from_end < 2 && run.last == frames_.last() && run.first > frames_.first();
  if (frame < run.first || frame > run.last || !(near_first || near_last)) return all_.data();
  const int length = run.last - run.first + 1;
  Eigen::VectorXd& mask = near_first ? mask_[frame] : mask_[2 + from_end];
  const Eigen::VectorXd& growth = near_first ? backward_[frame] : forward_[from_end];
  mask = (growth.array() * length > kExplosive).select(none_, all_);
  return mask.data();
}

/// The rows that begin before the run and end in it: row p begins m - p frames before.
template <int kReach>
RunCost RunElimination::rows_before(Run run) {
  const int lanes = rows_.lanes();
  RunCost cost{Lanes::Zero(lanes, 2 * kReach * kReach)};
  for (int p = 0; p < kReach; ++p) {
    const int row = run.first - kReach + p;
    for (int term = 0; term <= kReach; ++term) {
      const int frame = row + term;
      const double* coefficient = rows_.coefficient(row, term);
      const double* mask = allowed(run, frame);
      double* out = cost.rows.col(2 * kReach * p + p + term).data();
      for (int k = 0; k < lanes; ++k) out[k] = coefficient[k] * mask[k];
    }
  }
  return cost;
}

template <int kReach>
RunCost RunElimination::eliminate_rows(Run run) {
  const Eigen::Index lanes = rows_.lanes();
  RunCost cost = rows_before<kReach>(run);
  double* carried = cost.rows.data();
  const double *mask[kReach + 1], *coefficients[kReach + 1];
  for (int t = 0; t < kReach; ++t) mask[t] = allowed(run, run.first + t);
  for (int j = run.first; j <= run.last; ++j) {
    mask[kReach] = allowed(run, j + kReach);
    for (int t = 0; t <= kReach; ++t) coefficients[t] = rows_.coefficient(j, t);
    const double is_row = rows_.contains(j) ? 1 : 0;
    double* recovered = memory_.data() + place(j);
    for (Eigen::Index k = 0; k < lanes; k += kLaneWidth) {
      LanePacket fresh[kReach + 1];
      unrolled<kReach + 1>(
          [&](auto t) { fresh[t] = load_lanes(coefficients[t] + k) * load_lanes(mask[t] + k); });
      take_out_frame<kReach>(fresh, is_row, carried + k, recovered + k, lanes);
    }
    for (int t = 0; t < kReach; ++t) mask[t] = mask[t + 1];
  }
  return cost;
}

RunCost RunElimination::eliminate(Run run) {
  return rows_.reach() == 2 ? eliminate_rows<2>(run) : eliminate_rows<3>(run);
}

template <int kReach>
void RunElimination::fill_run(Run run, int first, Eigen::MatrixXd& z) const {
  const int modes = static_cast<int>(z.rows());
  const auto lanes = static_cast<Eigen::Index>(rows_.lanes());
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(modes);
  const auto columns = static_cast<int>(z.cols());
  auto column = [&](int frame) {
    if (frames_.is_cyclic()) frame = first + ((frame - first) % columns + columns) % columns;
    return frames_.contains(frame) ? z.col(frame - first).data() : rest.data();
  };
  const double *before[kReach], *behind[kReach];
  for (int c = 0; c < kReach; ++c) before[c] = column(run.first - kReach + c);
  for (int j = run.last; j >= run.first; --j) {
    const double* recovered = memory_.data() + place(j);
    for (int c = 0; c < kReach; ++c) behind[c] = column(j + 1 + c);
    double* out = z.col((j - first) % columns).data();
#pragma GCC ivdep
    for (Eigen::Index k = 0; k < modes; ++k) {
      double sum = 0;
      unrolled<kReach>([&](auto c) { sum += recovered[c * lanes + k] * behind[c][k]; });
      unrolled<kReach>([&](auto c) { sum += recovered[(kReach + c) * lanes + k] * before[c][k]; });
      out[k] = sum;
    }
  }
}

void RunElimination::fill(Run run, int first, Eigen::MatrixXd& z) const {
  if (rows_.reach() == 2) return fill_run<2>(run, first, z);
  fill_run<3>(run, first, z);
}

}  // namespace limber::spacetime
