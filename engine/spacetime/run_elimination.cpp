#include "engine/spacetime/run_elimination.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::spacetime {
namespace {

/// A free end lets a mode run on without force; where that multiplies the motion by more than
/// e^kExplosive over the run (lambda > 4, where the time step is too long for the mode, or damping
/// read backwards) the optimum of (17a) is a motion that nobody meant, in the end one beyond double
/// precision: the run's last frames are held at zero for that mode.
constexpr double kExplosive = 1.3862943611198906;  // log 4

}  // namespace

std::optional<int> pinned_frames(EndCondition end) {
  switch (end) {
    case EndCondition::kFree:
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
      last_(timeline.frame_count - 1 - pinned_frames(timeline.last).value_or(0)) {}

RunElimination::RunElimination(const ModeCoefficients& coefficients, const FreeFrames& frames)
    : coefficients_(coefficients), frames_(frames) {
  const Eigen::Index lanes = coefficients_.centre.size();
  memory_.assign(
      static_cast<std::size_t>(frames.frame_count()) * 4 * static_cast<std::size_t>(lanes), 0.0);
  none_ = Eigen::VectorXd::Zero(lanes);
  all_ = Eigen::VectorXd::Ones(lanes);
  for (auto* growth : {&forward_[0], &forward_[1], &backward_[0], &backward_[1]})
    growth->resize(lanes);
  for (Eigen::Index k = 0; k < lanes; ++k) {
    // Roots of next x^2 + centre x + 1 = 0; their product is 1 / next.
    const double b = coefficients_.centre[k], c = coefficients_.next[k];
    const double discriminant = b * b - 4 * c;
    const double log_product = -std::log(c);
    double large = log_product / 2;
    if (discriminant > 0) large = std::log((std::abs(b) + std::sqrt(discriminant)) / (2 * c));
    const double small = log_product - large;
    forward_[0][k] = large;
    forward_[1][k] = small;
    backward_[0][k] = -small;
    backward_[1][k] = -large;
  }
}

const double* RunElimination::allowed(Run run, int frame) {
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

RunCost RunElimination::eliminate(Run run) {
  const int lanes = static_cast<int>(coefficients_.centre.size());
  const int n = frames_.frame_count();
  const double* centre = coefficients_.centre.data();
  const double* next = coefficients_.next.data();
  auto row_exists = [n](int i) { return i >= 1 && i <= n - 2 ? 1.0 : 0.0; };

  // Two carried rows over (l1, l2, j, j + 1): x has no entry at j + 1 (rows run.first - 1 and
  // run.first of A).
  Lanes carry = Lanes::Zero(lanes, 7);
  double *xl1 = carry.col(0).data(), *xl2 = carry.col(1).data(), *x0 = carry.col(2).data();
  double *yl1 = carry.col(3).data(), *yl2 = carry.col(4).data(), *y0 = carry.col(5).data(),
         *y1 = carry.col(6).data();
  const double left1 = frames_.contains(run.first - 2) ? 1.0 : 0.0;
  const double left2 = frames_.contains(run.first - 1) ? 1.0 : 0.0;
  const double *p0 = allowed(run, run.first), *p1 = allowed(run, run.first + 1);
  {
    const double rx = row_exists(run.first - 1), ry = row_exists(run.first);
    for (int k = 0; k < lanes; ++k) {
      xl1[k] = rx * left1;
      xl2[k] = rx * left2 * centre[k];
      x0[k] = rx * next[k] * p0[k];
      yl2[k] = ry * left2;
      y0[k] = ry * centre[k] * p0[k];
      y1[k] = ry * next[k] * p1[k];
    }
  }
  for (int j = run.first; j <= run.last; ++j) {
    const double* p2 = allowed(run, j + 2);
    const double exists = row_exists(j + 1);
    double* out =
        memory_.data() + static_cast<std::size_t>(j) * 4 * static_cast<std::size_t>(lanes);
    for (int k = 0; k < lanes; ++k) {
      const double n0 = exists * p0[k], n1 = exists * centre[k] * p1[k],
                   n2 = exists * next[k] * p2[k];
      const double h = std::sqrt(x0[k] * x0[k] + y0[k] * y0[k]);
      const double ih = h > 0 ? 1 / h : 0.0;
      const double c = h > 0 ? x0[k] * ih : 1.0, s = y0[k] * ih;
      const double ul1 = c * xl1[k] + s * yl1[k], ul2 = c * xl2[k] + s * yl2[k], u1 = s * y1[k];
      const double vl1 = c * yl1[k] - s * xl1[k], vl2 = c * yl2[k] - s * xl2[k], v1 = c * y1[k];
      const double d = std::sqrt(h * h + n0 * n0);
      const double id = d > 0 ? 1 / d : 0.0;
      const double c2 = d > 0 ? h * id : 1.0, s2 = n0 * id;
      out[k] = -id * (c2 * u1 + s2 * n1);
      out[lanes + k] = -id * s2 * n2;
      out[2 * lanes + k] = -id * c2 * ul1;
      out[3 * lanes + k] = -id * c2 * ul2;
      // A frame held at zero at the last end leaves nothing to eliminate and brings no row: what
      // the two carried rows say of l1 and l2 stays a cost.
      const bool stays = d == 0 && exists == 0;
      xl1[k] = stays ? xl1[k] : vl1;
      xl2[k] = stays ? xl2[k] : vl2;
      x0[k] = stays ? 0.0 : v1;
      yl1[k] = stays ? yl1[k] : -s2 * ul1;
      yl2[k] = stays ? yl2[k] : -s2 * ul2;
      y0[k] = stays ? 0.0 : c2 * n1 - s2 * u1;
      y1[k] = stays ? 0.0 : c2 * n2;
    }
    p0 = p1;
    p1 = p2;
  }
  RunCost cost{Lanes::Zero(lanes, 8)};
  cost.rows.col(0) = carry.col(0);
  cost.rows.col(1) = carry.col(1);
  cost.rows.col(2) = carry.col(2);
  cost.rows.rightCols(4) = carry.rightCols(4);
  return cost;
}

void RunElimination::fill(Run run, int first, Eigen::MatrixXd& z) const {
  const int modes = static_cast<int>(z.rows());
  const auto lanes = static_cast<std::size_t>(coefficients_.centre.size());
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(modes);
  auto column = [&](int frame) {
    return frames_.contains(frame) ? z.col(frame - first).data() : rest.data();
  };
  const double* __restrict l1 = column(run.first - 2);
  const double* __restrict l2 = column(run.first - 1);
  for (int j = run.last; j >= run.first; --j) {
    const double* __restrict e = memory_.data() + static_cast<std::size_t>(j) * 4 * lanes;
    const double *f = e + 2 * lanes, *e2 = e + lanes, *f2 = e + 3 * lanes;
    const double *z1 = column(j + 1), *z2 = column(j + 2);
    double* out = z.col(j - first).data();
#pragma GCC ivdep
    for (int k = 0; k < modes; ++k) {
      out[k] = e[k] * z1[k] + e2[k] * z2[k] + f[k] * l1[k] + f2[k] * l2[k];
    }
  }
}

}  // namespace limber::spacetime
