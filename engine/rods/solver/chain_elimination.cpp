#include "engine/rods/solver/chain_elimination.h"

#include <algorithm>
#include <cstdint>

namespace limber::rods::detail {
namespace {

using Mask [[gnu::vector_size(8 * kChainLanes)]] = std::int64_t;
using Window = Lanes[kWindow][kWindow];  // [column][row], lower triangle

constexpr std::ptrdiff_t kBorder = kChainBlock + kAhead;  // first row of the start joint's numbers

/// Signs of pivots, lane by lane.
struct LaneCount {
  Mask positive = {}, negative = {}, vanishing = {};
};

/// Eliminates pivots kFirst .. 3 within their own columns and stores the divided columns. The
/// columns keep their values from before the division by their pivots.
template <int kFirst, std::ptrdiff_t kRows>
void eliminate_panel(Window& window, const Lanes* scales, Lanes* factor, LaneCount& count) {
  for (int c = kFirst; c < kChainBlock; ++c) {
    Lanes* const column = window[c];
    for (int p = kFirst; p < c; ++p) {
      const Lanes scale = factor[p * kWindow + c];
      for (int r = c; r < kRows; ++r) column[r] -= window[p][r] * scale;
    }
    const Lanes least = kVanishingPivot * (scales[c] < 0 ? -scales[c] : scales[c]);
    const Mask sound = (column[c] < 0 ? -column[c] : column[c]) > least;
    const Lanes pivot = sound ? column[c] : (least > 0 ? least : Lanes{} + 1.0);
    count.positive -= sound & (column[c] > 0);
    count.negative -= sound & (column[c] < 0);
    count.vanishing -= ~sound;
    const Lanes inverse = 1.0 / pivot;
    Lanes* const stored = factor + c * kWindow;
    stored[c] = inverse;
    for (int r = c + 1; r < kRows; ++r) stored[r] = column[r] * inverse;
  }
}

/// Content of a window's entries that no earlier block has touched.
enum class Untouched { kZero, kInWindow };

/// Rows kBegin .. kEnd - 1 of two columns side by side, less the parts that pivots kFirst .. 3 take
/// from them, all pivots at once. They go to where the next block has them: rows ahead move on, the
/// border's stay.
template <int kFirst, int kBegin, int kEnd, bool kZero>
[[gnu::always_inline]] inline void subtract_rows(const Window& window, const Lanes* factor,
                                                 const int (&columns)[2], int from, Window& next) {
  constexpr std::ptrdiff_t kMove = kBegin < kBorder ? kChainBlock : 0;
  Lanes scale[2][kChainBlock];
  Lanes* to[2];
  for (int n = 0; n < 2; ++n) {
    for (int p = kFirst; p < kChainBlock; ++p) scale[n][p] = factor[p * kWindow + columns[n]];
    to[n] = next[columns[n] < kBorder ? columns[n] - kChainBlock : columns[n]];
  }
  for (std::ptrdiff_t r = std::max(kBegin, from); r < kEnd; ++r) {
    Lanes sum[2];
    for (int n = 0; n < 2; ++n) sum[n] = kZero ? Lanes{} : window[columns[n]][r];
    for (int p = kFirst; p < kChainBlock; ++p) {
      const Lanes value = window[p][r];
      for (int n = 0; n < 2; ++n) sum[n] -= value * scale[n][p];
    }
    for (int n = 0; n < 2; ++n) to[n][r - kMove] = sum[n];
  }
}

/// Eliminates the window's pivots kFirst .. 3, stores their columns and leaves the next window. The
/// seven rows ahead become the next pivots and the first three rows ahead of those. The others,
/// with their columns, are zero and not written.
template <int kFirst, bool kHasBorder, Untouched kUntouched>
void eliminate_block(Window& window, const Lanes* scales, Lanes* factor, LaneCount& count,
                     Window& next) {
  constexpr bool kZero = kUntouched == Untouched::kZero;
  eliminate_panel<kFirst, kHasBorder ? kWindow : kBorder>(window, scales, factor, count);
  for (int k = kChainBlock; k < kAhead; k += 2) {
    const int columns[2] = {k, std::min<int>(k + 1, kAhead - 1)};
    subtract_rows<kFirst, kChainBlock, kAhead, false>(window, factor, columns, k, next);
    subtract_rows<kFirst, kAhead, kBorder, kZero>(window, factor, columns, k, next);
    if constexpr (kHasBorder)
      subtract_rows<kFirst, kBorder, kWindow, false>(window, factor, columns, k, next);
  }
  for (int k = kAhead; k < kBorder; k += 2) {
    const int columns[2] = {k, k + 1};
    subtract_rows<kFirst, kAhead, kBorder, kZero>(window, factor, columns, k, next);
    if constexpr (kHasBorder)
      subtract_rows<kFirst, kBorder, kWindow, kZero>(window, factor, columns, k, next);
  }
  if constexpr (!kHasBorder) return;
  for (int k = kBorder; k < kWindow; k += 2) {
    const int columns[2] = {k, std::min<int>(k + 1, kWindow - 1)};
    subtract_rows<kFirst, kBorder, kWindow, false>(window, factor, columns, k, next);
  }
}

class Elimination {
 public:
  Elimination(const ChainBatch& batch, const Lanes* band, const ChainAdjustment& adjustment)
      : batch_(batch), band_(band), adjustment_(adjustment) {}

  template <bool kHasBorder>
  LaneCount run(Lanes* factor, ChainRemainder& remainder) {
    LaneCount count;
    for (int c = 0; c < kBorder; ++c) {
      for (int r = c; r < kWindow; ++r) window()[c][r] = Lanes{};
    }
    Lanes scales[kChainBlock];
    int block = batch_.first_block();
    if constexpr (kHasBorder) {
      load_border();
      load_block(block, kChainBlock - 1, scales);
      eliminate_block<kChainBlock - 1, true, Untouched::kInWindow>(window(), scales, factor, count,
                                                                   next());
      now_ ^= 1;
      factor += kBlockFactor;
      ++block;
    }
    for (; block < batch_.end_block(); ++block, factor += kBlockFactor) {
      load_block(block, 0, scales);
      eliminate_block<0, kHasBorder, Untouched::kZero>(window(), scales, factor, count, next());
      now_ ^= 1;
    }
    leave(remainder);
    return count;
  }

 private:
  [[nodiscard]] Window& window() { return windows_[now_]; }
  [[nodiscard]] Window& next() { return windows_[now_ ^ 1]; }
  [[nodiscard]] const Lanes& entry(int row, int column) const {
    return band_[column * kBandHeight + row - column];
  }
  /// By reference: vectors as values change the ABI where the instruction set is smaller.
  [[nodiscard]] const Lanes& kept(int number) const {
    const bool own = number >= batch_.begin() && number < batch_.end();
    return own && adjustment_.keep != nullptr ? adjustment_.keep[number] : one_;
  }

  /// The start joint's numbers among themselves and with the chain's first rows.
  void load_border() {
    Window& window = this->window();
    for (int c = 0; c < kTerminalSize; ++c) {
      for (int r = c; r < kTerminalSize; ++r) window[kBorder + c][kBorder + r] = entry(r, c);
      // Number 7 is the one pivot of the first window, 8 to 14 are ahead of it.
      for (int r = kTerminalSize; r < std::min(c + kBandHeight, kTerminalSize + 1 + kAhead); ++r) {
        const int place = r - kTerminalSize + kChainBlock - 1;
        window[place][kBorder + c] = entry(r, c) * kept(r);
      }
    }
  }

  /// Adds the columns of block j, pivots first .. 3, with everything of them that is in the band;
  /// rows that no earlier block has touched are new.
  void load_block(int block, int first, Lanes* scales) {
    const int begin = 4 * block;
    for (int c = first; c < kChainBlock; ++c) {
      Lanes* const values = window()[c];
      const int column = begin + c;
      if (column >= batch_.numbers()) {  // padding of the last block
        values[c] = scales[c] = Lanes{} + 1.0;
        for (int r = kAhead; r < kBorder; ++r) values[r] = Lanes{};
        continue;
      }
      Lanes diagonal = entry(column, column);
      if (adjustment_.shift != nullptr) diagonal += adjustment_.shift[column];
      const Lanes* const below = band_ + column * kBandHeight;
      if (adjustment_.keep == nullptr) {
        for (int r = c + 1; r < kAhead; ++r) values[r] += below[r - c];
        for (int r = kAhead; r < kBorder; ++r) values[r] = below[r - c];
      } else {
        const Lanes keep = kept(column);
        diagonal = diagonal * keep + (1.0 - keep);
        for (int r = c + 1; r < kAhead; ++r) values[r] += below[r - c] * keep * kept(begin + r);
        for (int r = kAhead; r < kBorder; ++r) values[r] = below[r - c] * keep * kept(begin + r);
      }
      values[c] += diagonal;
      scales[c] = diagonal;
    }
  }

  /// Leaves the part that the joints see: the last seven numbers and the border.
  void leave(ChainRemainder& remainder) {
    const Window& window = this->window();
    const int end = batch_.end();
    for (int c = 0; c < kTerminalSize; ++c) {
      for (int r = c; r < kTerminalSize; ++r) {
        remainder.entries[c][r] =
            window[c][r] + (batch_.has_finish ? entry(end + r, end + c) : Lanes{});
        remainder.entries[kTerminalSize + c][kTerminalSize + r] = window[kBorder + c][kBorder + r];
      }
      for (int r = 0; r < kTerminalSize; ++r)
        remainder.entries[c][kTerminalSize + r] = window[c][kBorder + r];
    }
  }

  const ChainBatch& batch_;
  const Lanes* band_;
  const ChainAdjustment& adjustment_;
  const Lanes one_ = Lanes{} + 1.0;
  Window windows_[2];
  int now_ = 0;
};

}  // namespace

PivotCount eliminate_chains(const ChainBatch& batch, const Lanes* band,
                            const ChainAdjustment& adjustment, Lanes* factor,
                            ChainRemainder& remainder) {
  Elimination elimination(batch, band, adjustment);
  const LaneCount count = batch.has_start ? elimination.run<true>(factor, remainder)
                                          : elimination.run<false>(factor, remainder);
  PivotCount total;
  for (int lane = 0; lane < kChainLanes; ++lane) {
    if (batch.chains[lane] < 0) continue;
    total.positive += static_cast<int>(count.positive[lane]) - (batch.has_finish ? 0 : 1);
    total.negative += static_cast<int>(count.negative[lane]);
    total.vanishing += static_cast<int>(count.vanishing[lane]);
  }
  return total;
}

namespace {

/// Pivots first .. 3 of a block leave the rows below and the border, all at once.
template <int kFirst, bool kHasBorder>
void forward_block(const Lanes* factor, Lanes* rows, Lanes* border) {
  Lanes known[kChainBlock];
  for (int c = kFirst; c < kChainBlock; ++c) {
    known[c] = rows[c];
    for (int r = c + 1; r < kChainBlock; ++r) rows[r] -= factor[c * kWindow + r] * known[c];
  }
  for (int r = kChainBlock; r < kBorder; ++r) {
    Lanes sum = rows[r];
    for (int c = kFirst; c < kChainBlock; ++c) sum -= factor[c * kWindow + r] * known[c];
    rows[r] = sum;
  }
  if constexpr (!kHasBorder) return;
  for (int r = 0; r < kTerminalSize; ++r) {
    Lanes sum = border[r];
    for (int c = kFirst; c < kChainBlock; ++c) sum -= factor[c * kWindow + kBorder + r] * known[c];
    border[r] = sum;
  }
}

template <int kFirst, bool kHasBorder>
void backward_block(const Lanes* factor, Lanes* rows, const Lanes* border) {
  Lanes sums[kChainBlock];
  for (int c = kFirst; c < kChainBlock; ++c) sums[c] = rows[c] * factor[c * kWindow + c];
  for (int r = kChainBlock; r < kBorder; ++r) {
    const Lanes given = rows[r];
    for (int c = kFirst; c < kChainBlock; ++c) sums[c] -= factor[c * kWindow + r] * given;
  }
  if constexpr (kHasBorder) {
    for (int r = 0; r < kTerminalSize; ++r) {
      const Lanes given = border[r];
      for (int c = kFirst; c < kChainBlock; ++c)
        sums[c] -= factor[c * kWindow + kBorder + r] * given;
    }
  }
  for (int c = kChainBlock - 1; c >= kFirst; --c) {
    for (int r = c + 1; r < kChainBlock; ++r) sums[c] -= factor[c * kWindow + r] * rows[r];
    rows[c] = sums[c];
  }
}

template <bool kHasBorder>
void forward_chains(const ChainBatch& batch, const Lanes* factor, Lanes* numbers) {
  int block = batch.first_block();
  if constexpr (kHasBorder) {
    forward_block<kChainBlock - 1, true>(factor, numbers + kChainBlock * block, numbers);
    factor += kBlockFactor;
    ++block;
  }
  for (; block < batch.end_block(); ++block, factor += kBlockFactor)
    forward_block<0, kHasBorder>(factor, numbers + kChainBlock * block, numbers);
}

template <bool kHasBorder>
void backward_chains(const ChainBatch& batch, const Lanes* factor, Lanes* numbers) {
  const int first = batch.first_block();
  for (int block = batch.end_block() - 1; block >= first + (kHasBorder ? 1 : 0); --block)
    backward_block<0, kHasBorder>(factor + (block - first) * kBlockFactor,
                                  numbers + kChainBlock * block, numbers);
  if constexpr (kHasBorder)
    backward_block<kChainBlock - 1, true>(factor, numbers + kChainBlock * first, numbers);
}

}  // namespace

void substitute_forward(const ChainBatch& batch, const Lanes* factor, Lanes* numbers) {
  if (batch.has_start) {
    forward_chains<true>(batch, factor, numbers);
  } else {
    forward_chains<false>(batch, factor, numbers);
  }
}

void substitute_backward(const ChainBatch& batch, const Lanes* factor, Lanes* numbers) {
  if (batch.has_start) {
    backward_chains<true>(batch, factor, numbers);
  } else {
    backward_chains<false>(batch, factor, numbers);
  }
}

}  // namespace limber::rods::detail
