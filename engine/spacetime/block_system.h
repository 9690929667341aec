#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "engine/spacetime/mode_systems.h"

namespace limber::spacetime {

/// H = K + proximal I + a symmetric r x r block at each knot, over the kept frames. K is diagonal
/// in the modes and at most three kept frames wide (five, where force rows have four terms), the
/// knots' blocks are dense in the modes. Kept frames are taken together in groups, mostly a knot
/// and the frame (or two) behind it, such that none couples to more than the next group:
///
///        f0  f1 | f2  f3        f: kept frames, each r x r
///   f0 [ B   d  | d   d  ]      B: dense (a knot), d: diagonal
///   f1 [ d   d  | d   d  ]
///      ------------------
///   f2 [ d   d  | B   d  ]
///   f3 [ d   d  | d   d  ]
///
/// and factored by block tridiagonal Cholesky, H = F F^T: time linear in the number of knots, cubic
/// in r. If a row of constraints couples two knots (a velocity), the block between these is dense
/// as well. In a cycle the last group couples to all others: an arrow of blocks below them.
class BlockSystem {
 public:
  /// Adds the block of a knot to the r x r matrix given.
  using AddBlock = std::function<void(int knot, Eigen::Ref<Eigen::MatrixXd> block)>;
  /// Knots with a block between them.
  struct Tie {
    int knot = 0, later = 0;  // knot < later
    Eigen::MatrixXd block;    // r x r, rows of `later`
  };

  /// @returns false if H is not positive definite
  [[nodiscard]] bool factor(const ModeSystems& systems, const AddBlock& add_block,
                            const std::vector<Tie>& ties = {});
  /// x <- H^-1 x, lanes x kept.
  void solve(Lanes& x) const;
  /// x <- F^-1 x, so that x^T H^-1 y is the inner product of both.
  /// @param x       (r kept) x n, the modes of each kept frame after those of the one before
  /// @param starts  n ascending kept frames: column i is zero before starts[i]
  void half_solve(Eigen::MatrixXd& x, const std::vector<int>& starts) const;

 private:
  void group_frames(const ModeSystems& systems, const std::vector<Tie>& ties);
  void assemble(const ModeSystems& systems, const AddBlock& add_block,
                const std::vector<Tie>& ties);
  /// Rows of the last group in a group before the one before it; empty but in cycles.
  [[nodiscard]] bool has_arrow(std::size_t group) const { return arrow_[group].size() > 0; }
  [[nodiscard]] int group_count() const { return static_cast<int>(first_.size()) - 1; }
  template <class Block>
  void add_over_seam(const BandedRow& row, int width, int count, const Block& block);
  /// Index of a frame's first mode in its group.
  [[nodiscard]] Eigen::Index place(int frame) const;

  int modes_ = 0;
  std::vector<int> first_;     // kept frame that each group begins with; last: their number
  std::vector<int> group_of_;  // per kept frame
  std::vector<Eigen::MatrixXd> diagonal_;  // per group: H, then its Cholesky factor (lower)
  std::vector<Eigen::MatrixXd> below_;     // per group: rows of the next group, the same
  std::vector<Eigen::MatrixXd> arrow_;     // of a cycle: rows of the last group, beyond the next
  mutable Eigen::VectorXd x_;
};

}  // namespace limber::spacetime
