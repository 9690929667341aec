#pragma once

#include "engine/rods/rod/edge_stiffness.h"
#include "engine/rods/rod/rod_layout.h"

namespace limber::rods {

/// A Hessian of rods, or a derivative of one. Its variables are the edge vectors e and angles theta
/// of every edge, and of every edge with the next one of its rod. Everything else follows from e =
/// x_after - x_before: the joints of a linkage take the blocks as they are, single rods want them
/// by nodes (`for_each_entry`).
///
///            e_j  theta_j   e_(j+1)  theta_(j+1)
///    e_j   [ ee     et    |   ee         et    ]
///  theta_j [ et^T   tt    |   te         tt    ]
///            edge(j)          cross(j), zero where the rod ends with edge j
class HessianBlocks {
 public:
  [[nodiscard]] EdgeBlock<double> edge(int slot) const;
  [[nodiscard]] CrossBlock<double> cross(int slot) const;

  /// One row per slot. The columns are ee (6: lower triangle by rows), et (3), tt of the edge; then
  /// ee (9, by columns), et (3), te (3), tt of the cross block.
  [[nodiscard]] const SlotArray& values() const { return values_; }

 private:
  friend HessianBlocks hessian_blocks(SlotArray values);
  SlotArray values_;
};

/// From an array of those columns.
[[nodiscard]] HessianBlocks hessian_blocks(SlotArray values);

/// Calls entry(row, column, value) for the lower triangle of the Hessian by the unknowns of the
/// layout; a position may come several times, its values add up. Entries lie at most 10 rows below
/// the diagonal.
template <class Entry>
void for_each_entry(const RodLayout& layout, const HessianBlocks& blocks, Entry&& entry);

/// The lower band: (d, j) is H(j + d, j), 11 x unknowns.
inline constexpr int kRodBandwidth = 10;
[[nodiscard]] Eigen::MatrixXd banded(const RodLayout& layout, const HessianBlocks& blocks);

template <class Entry>
void for_each_entry(const RodLayout& layout, const HessianBlocks& blocks, Entry&& entry) {
  const auto matrix = [](const Mat3<double>& m, double(&out)[3][3]) {
    for (int c = 0; c < 3; ++c) {
      out[0][c] = m.column[c].x;
      out[1][c] = m.column[c].y;
      out[2][c] = m.column[c].z;
    }
  };
  for (int j = 0; j < layout.nodes(); ++j) {
    if (!layout.is_edge(j)) continue;
    const int x0 = 4 * j, t0 = x0 + 3, x1 = x0 + 4, t1 = x0 + 7, x2 = x0 + 8;
    double m[3][3];
    const EdgeBlock<double> own = blocks.edge(j);
    matrix(full(own.ee), m);
    const double et[3] = {own.et.x, own.et.y, own.et.z};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c <= r; ++c) {
        entry(x0 + r, x0 + c, m[r][c]);
        entry(x1 + r, x1 + c, m[r][c]);
      }
      for (int c = 0; c < 3; ++c) entry(x1 + r, x0 + c, -m[r][c]);
      entry(t0, x0 + r, -et[r]);
      entry(x1 + r, t0, et[r]);
    }
    entry(t0, t0, own.tt);
    if (!layout.is_interior(j + 1)) continue;
    const CrossBlock<double> cross = blocks.cross(j);
    matrix(cross.ee, m);
    const double ct[3] = {cross.et.x, cross.et.y, cross.et.z};
    const double tc[3] = {cross.te.x, cross.te.y, cross.te.z};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) {
        entry(x2 + c, x1 + r, m[r][c]);
        entry(x2 + c, x0 + r, -m[r][c]);
        entry(x1 + c, x0 + r, m[r][c]);
        if (c <= r) entry(x1 + r, x1 + c, -m[r][c] - m[c][r]);
      }
      entry(t1, x1 + r, ct[r]);
      entry(t1, x0 + r, -ct[r]);
      entry(x2 + r, t0, tc[r]);
      entry(x1 + r, t0, -tc[r]);
    }
    entry(t1, t0, cross.tt);
  }
}

}  // namespace limber::rods
