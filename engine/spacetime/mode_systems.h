#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "engine/spacetime/banded_factor.h"
#include "engine/spacetime/green_blocks.h"
#include "engine/spacetime/run_elimination.h"

namespace limber::spacetime {

/// E_f (paper: space-time editing, eq. 17a) as a function of the few frames that matter. Each
/// constrained frame (a "knot") and the frame beside it are kept, two where force rows have four
/// terms. All others are eliminated exactly. E_f = 1/2 sum_k |L_k z_k|^2 over the kept frames; cost
/// of everything below set_knots() and interpolate() does not depend on N.
class ModeSystems {
 public:
  ModeSystems(const ModeDynamics& dynamics, const Timeline& timeline);

  /// @param knots  free frames, sorted, distinct. Runs between the same frames as before are not
  /// redone.
  void set_knots(std::vector<int> knots);

  [[nodiscard]] const FreeFrames& frames() const { return frames_; }
  [[nodiscard]] int modes() const { return modes_; }
  [[nodiscard]] int lanes() const { return lanes_; }
  [[nodiscard]] int kept_count() const { return static_cast<int>(kept_.size()); }
  [[nodiscard]] const std::vector<int>& kept() const { return kept_; }
  [[nodiscard]] const std::vector<int>& knots() const { return knots_; }
  /// Index among the kept frames of a knot.
  [[nodiscard]] int kept_of_knot(int knot) const {
    return kept_of_knot_[static_cast<std::size_t>(knot)];
  }

  [[nodiscard]] const std::vector<int>& knots_kept() const { return kept_of_knot_; }
  /// Number of kept frames that one of rows() couples.
  [[nodiscard]] int width() const { return 2 * force_rows_.reach(); }
  [[nodiscard]] Shape shape() const { return frames_.is_cyclic() ? Shape::kCycle : Shape::kBand; }

  /// L: rows over the kept frames, sorted by start.
  [[nodiscard]] const std::vector<BandedRow>& rows() const { return rows_; }
  /// K z with K = L^T L, z lanes x kept.
  void apply(const Lanes& z, Lanes& product) const { apply_normal(rows_, z, product); }
  [[nodiscard]] double energy(const Lanes& z) const { return half_square(rows_, z); }
  /// x <- (K + proximal I)^-1 x.
  void solve(Lanes& x) const { factor_.solve(x); }
  /// Blocks of (K + proximal I)^-1 between the knots, computed on first use.
  [[nodiscard]] const GreenBlocks& green() const;
  /// green() at one knot and itself, without all the others: lanes.
  void response(int knot, Eigen::VectorXd& own) const;

  /// Kept frames -> every frame; z is modes x N. Pinned frames are zero.
  void interpolate(const Lanes& kept, Eigen::MatrixXd& z) const;
  /// Some of these columns, at the cost of the runs that they lie in.
  [[nodiscard]] Eigen::MatrixXd interpolate(const Lanes& kept, FrameSpan frames) const;
  /// Of these runs.
  [[nodiscard]] int frames_to_fill(FrameSpan frames) const;
  /// Every frame -> kept frames.
  void gather(const Eigen::MatrixXd& z, Lanes& kept) const;

  /// Weight of |dz|^2 / 2 (proximal: about the current iterate, so it never shows in a converged
  /// answer) that makes the factor exist for free ends and at resonance. The residual it leaves is
  /// taken out by conjugate gradients.
  static constexpr double kProximal = 1e-8;

 private:
  void keep_frames();
  void append_run(Run run, const RunCost& cost, int start);
  void append_raw_row(int row);
  void append_over_seam(const Lanes& columns);

  int modes_, lanes_;
  ForceRows force_rows_;
  FreeFrames frames_;
  RunElimination elimination_;
  std::vector<int> knots_, kept_, kept_of_knot_;
  std::vector<Run> runs_;
  std::map<std::pair<int, int>, RunCost> costs_;  // of the present runs, by (first, last)
  std::vector<BandedRow> rows_;
  BandedFactor factor_;
  mutable GreenBlocks green_;
  mutable bool green_known_ = false;
};

}  // namespace limber::spacetime
