#pragma once

#include <Eigen/Core>

#include "engine/spacetime/lanes.h"
#include "engine/spacetime/problem.h"

namespace limber::spacetime {

/// Valid members of ModeDynamics: one of the enumerators; 0 <= tau <= 1e6; c > 0, and w > 0 of each
/// mode or of none.
[[nodiscard]] bool is_discretisation(Discretisation value);
[[nodiscard]] bool is_smoothing(double tau);
/// c and the shares, of which there are none or one for each mode.
[[nodiscard]] bool are_force_weights(const ModeDynamics& dynamics);

/// The force on a mode in frame i: before z_(i-1) + centre z_i + next z_(i+1).
///
/// kDifferences (paper: space-time editing, eq. 17a): 1, -2 - d + lambda, 1 + d.
///
/// kSampled: q e^(-d), -q (x_1 + x_2), q. x_1, x_2 = e^(-d/2 +- i sqrt(lambda - d^2/4)) are the
/// factors of the mode's free solutions over one frame (real above critical damping). q makes a
/// constant z cost lambda z, its static force, and is 1 for a mode without stiffness and damping.
/// For slow modes both forms agree to first order in the step.
///
/// A sampled mode faster than the Nyquist frequency looks slower than it is. At whole turns a frame
/// it would appear at rest, and q would have no bound. Therefore it is damped by at least 1/10 of
/// the excess frequency. Damping ratios of 0.1 and more are never changed by this.
struct ForceStencil {
  double before = 1, centre = -2, next = 1;
};
[[nodiscard]] ForceStencil force_stencil(Discretisation discretisation, double stiffness,
                                         double damping);
[[nodiscard]] inline ForceStencil force_stencil(const ModeDynamics& dynamics, Eigen::Index mode) {
  return force_stencil(dynamics.discretisation, dynamics.stiffness[mode], dynamics.damping[mode]);
}

/// By how much the two free solutions grow from frame to frame, as logarithms of their ratios.
struct FreeGrowth {
  double larger = 0, smaller = 0;  // both half the sum's where the mode swings
};
[[nodiscard]] FreeGrowth free_growth(const ForceStencil& stencil);

/// I + tau^2 D^T D = B^T B, with D the differences of neighbouring forces. Row i of B is own f_i +
/// following f_(i+1): own^2 + following^2 = 1 + 2 tau^2, own * following = -tau^2. The solution
/// with sum 1 is taken, so that a constant force costs itself.
struct ForceSmoothing {
  explicit ForceSmoothing(double tau);
  double own = 1, following = 0;
};

/// B f of the forces f of one mode: its rows are one more than forces, which are zero before the
/// first and after the last. @param tau  > 0
[[nodiscard]] Eigen::RowVectorXd smoothed_forces(const Eigen::RowVectorXd& forces, double tau);
/// The same of a cycle, in which the first force follows the last: as many rows as forces.
[[nodiscard]] Eigen::RowVectorXd smoothed_cycle(const Eigen::RowVectorXd& forces, double tau);

/// Cost of the first two frames of a sampled mode, 1/2 (place z_0)^2 + 1/2 (lag z_0 + speed z_1)^2.
/// It is the least force that brings the mode from rest, long before, to its position and velocity
/// there.
///
/// If a damped mode could begin with any swing at no cost, it would: the free motion that passes
/// through two late keys began a thousand body lengths away. With white forces z is a stationary
/// autoregressive process of second order; this is the inverse of the covariance of neighbours
/// (Yule-Walker equations), which is zero without damping. Smooth forces count 1 + tau^2 |1 - x_1|
/// |1 - x_2| times, as those that change with the mode (exact for swings of little damping).
struct BeginningCost {
  double place = 0, lag = 0, speed = 0;
};
[[nodiscard]] BeginningCost beginning_cost(double stiffness, double damping, double tau);

/// State before the first frame.
enum class Beginning {
  kFromRest,  // sampled modes were at rest long before (BeginningCost)
  kAnyhow,    // anything: parts of a motion that go on from a known state
  kCyclic,    // the last frame
};

[[nodiscard]] inline Beginning beginning_of(const Timeline& timeline) {
  return timeline.is_cyclic() ? Beginning::kCyclic : Beginning::kFromRest;
}

/// The rows of E_f = 1/2 sum |row z|^2, sqrt(c w) in each, alike for all frames but at the ends. A
/// row is named by the first of its frames: row i is coefficient(i, t) z_(i+t), t = 0 .. reach().
///
/// Without smoothing row i is the force in frame i + 1, i = 0 .. N - 3. With smoothing it is own
/// f_(i+1) + following f_(i+2), i = -1 .. N - 3: forces rise from zero at the first frame and
/// return to zero at the last, as those of a body that rests or swings freely outside. Left out at
/// an end, these rows would let a force stand there that costs nothing. Sampled modes have two rows
/// more that begin before the time line, of BeginningCost. In a cycle rows 0 .. N - 1 are alike,
/// and frame N is frame 0.
class ForceRows {
 public:
  /// @param frame_count  N >= 3
  ForceRows(const ModeDynamics& dynamics, int frame_count,
            Beginning beginning = Beginning::kFromRest);

  [[nodiscard]] int lanes() const { return static_cast<int>(rest_.size()); }
  /// Frames before the last one of a row: 2, with smoothing 3.
  [[nodiscard]] int reach() const { return reach_; }
  [[nodiscard]] int first() const { return first_; }
  [[nodiscard]] int last() const { return last_; }
  /// In a cycle every row is there again after N frames.
  [[nodiscard]] bool contains(int row) const {
    return is_cyclic() || (row >= first() && row <= last_);
  }
  [[nodiscard]] bool is_cyclic() const { return beginning_of_motion_ == Beginning::kCyclic; }
  /// One number per lane; zeros for rows that do not exist. Those of frames outside the time line
  /// are zero. Spare lanes have a harmless mode.
  [[nodiscard]] const double* coefficient(int row, int term) const;
  [[nodiscard]] FreeGrowth growth(int lane) const;
  /// Whether damping limits what a motion begins with.
  [[nodiscard]] bool begins_from_rest() const {
    return beginning_of_motion_ == Beginning::kFromRest;
  }

 private:
  [[nodiscard]] const double* beginning(int row, int term) const;

  Beginning beginning_of_motion_;
  int reach_, first_ = 0, last_ = 0;
  Lanes stencil_;                    // lanes x 3
  Lanes opening_, inner_, closing_;  // lanes x (reach + 1): of row -1, of most rows, of the last
  Lanes beginning_;                  // lanes x 3: place, lag, speed
  Eigen::VectorXd rest_;             // zeros
};

}  // namespace limber::spacetime
