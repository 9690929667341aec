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

/// Eliminates the window's pivots kFirst .. 3 and stores their columns.
template <int kFirst, bool kHasBorder>
void eliminate_block(Window& window, const Lanes* scales, Lanes* factor, LaneCount& count) {
  constexpr std::ptrdiff_t kRows = kHasBorder ? kWindow : kBorder;
  for (int c = kFirst; c < kChainBlock; ++c) {
    Lanes* const column = window[c];
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
    for (int k = c + 1; k < kRows; ++k) {
      const Lanes scale = stored[k];
      for (int r = k; r < kRows; ++r) window[k][r] -= column[r] * scale;
    }
  }
}

/// Moves the window on by one block.
template <bool kHasBorder>
void advance(Window& window) {
  // The seven rows ahead become the next pivots and the first three rows ahead of those.
  for (int c = 0; c < kAhead; ++c) {
    for (int r = c; r < kAhead; ++r) window[c][r] = window[kChainBlock + c][kChainBlock + r];
    for (int r = kAhead; r < kBorder; ++r) window[c][r] = Lanes{};
    if constexpr (kHasBorder) {
      for (int r = kBorder; r < kWindow; ++r) window[c][r] = window[kChainBlock + c][r];
    }
  }
  for (int c = kAhead; c < kBorder; ++c) {
    for (int r = c; r < kWindow; ++r) window[c][r] = Lanes{};
  }
}

class Elimination {
 public:
  Elimination(const ChainBatch& batch, const Lanes* band, const ChainAdjustment& adjustment)
      : batch_(batch), band_(band), adjustment_(adjustment) {}

  template <bool kHasBorder>
  LaneCount run(Lanes* factor, ChainRemainder& remainder) {
    LaneCount count;
    for (auto& column : window_) std::fill(std::begin(column), std::end(column), Lanes{});
    Lanes scales[kChainBlock];
    int block = batch_.first_block();
    if constexpr (kHasBorder) {
      load_border();
      load_block(block, kChainBlock - 1, scales);
      eliminate_block<kChainBlock - 1, true>(window_, scales, factor, count);
      advance<true>(window_);
      factor += kBlockFactor;
      ++block;
    }
    for (; block < batch_.end_block(); ++block, factor += kBlockFactor) {
      load_block(block, 0, scales);
      eliminate_block<0, kHasBorder>(window_, scales, factor, count);
      advance<kHasBorder>(window_);
    }
    leave(remainder);
    return count;
  }

 private:
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
    for (int c = 0; c < kTerminalSize; ++c) {
      for (int r = c; r < kTerminalSize; ++r) window_[kBorder + c][kBorder + r] = entry(r, c);
      // Number 7 is the one pivot of the first window, 8 to 14 are ahead of it.
      for (int r = kTerminalSize; r < std::min(c + kBandHeight, kTerminalSize + 1 + kAhead); ++r) {
        const int place = r - kTerminalSize + kChainBlock - 1;
        window_[place][kBorder + c] = entry(r, c) * kept(r);
      }
    }
  }

  /// Adds the columns of block j, pivots first .. 3, with everything of them that is in the band.
  void load_block(int block, int first, Lanes* scales) {
    const int begin = 4 * block;
    for (int c = first; c < kChainBlock; ++c) {
      const int column = begin + c;
      if (column >= batch_.numbers()) {  // padding of the last block
        window_[c][c] = scales[c] = Lanes{} + 1.0;
        continue;
      }
      Lanes diagonal = entry(column, column);
      if (adjustment_.shift != nullptr) diagonal += adjustment_.shift[column];
      const Lanes* const below = band_ + column * kBandHeight;
      if (adjustment_.keep == nullptr) {
        for (int r = c + 1; r < kBorder; ++r) window_[c][r] += below[r - c];
      } else {
        const Lanes keep = kept(column);
        diagonal = diagonal * keep + (1.0 - keep);
        for (int r = c + 1; r < kBorder; ++r)
          window_[c][r] += below[r - c] * keep * kept(begin + r);
      }
      window_[c][c] += diagonal;
      scales[c] = diagonal;
    }
  }

  /// What the joints see: the last seven numbers and the border.
  void leave(ChainRemainder& remainder) const {
    const int end = batch_.end();
    for (int c = 0; c < kTerminalSize; ++c) {
      for (int r = c; r < kTerminalSize; ++r) {
        remainder.entries[c][r] =
            window_[c][r] + (batch_.has_finish ? entry(end + r, end + c) : Lanes{});
        remainder.entries[kTerminalSize + c][kTerminalSize + r] = window_[kBorder + c][kBorder + r];
      }
      for (int r = 0; r < kTerminalSize; ++r)
        remainder.entries[c][kTerminalSize + r] = window_[c][kBorder + r];
    }
  }

  const ChainBatch& batch_;
  const Lanes* band_;
  const ChainAdjustment& adjustment_;
  const Lanes one_ = Lanes{} + 1.0;
  Window window_;
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

void substitute_forward(const ChainBatch& batch, const Lanes* factor, Lanes* numbers) {
  for (int block = batch.first_block(); block < batch.end_block(); ++block) {
    Lanes* const rows = numbers + kChainBlock * block;
    const int first = batch.has_start && block == 1 ? kChainBlock - 1 : 0;
    for (int c = first; c < kChainBlock; ++c) {
      const Lanes* const column = factor + c * kWindow;
      const Lanes value = rows[c];
      for (int r = c + 1; r < kBorder; ++r) rows[r] -= column[r] * value;
      if (batch.has_start) {
        for (int r = 0; r < kTerminalSize; ++r) numbers[r] -= column[kBorder + r] * value;
      }
    }
    factor += kBlockFactor;
  }
}

void substitute_backward(const ChainBatch& batch, const Lanes* factor, Lanes* numbers) {
  const int blocks = batch.end_block() - batch.first_block();
  factor += static_cast<std::ptrdiff_t>(blocks) * kBlockFactor;
  for (int block = batch.end_block() - 1; block >= batch.first_block(); --block) {
    factor -= kBlockFactor;
    Lanes* const rows = numbers + kChainBlock * block;
    const int first = batch.has_start && block == 1 ? kChainBlock - 1 : 0;
    for (int c = kChainBlock - 1; c >= first; --c) {
      const Lanes* const column = factor + c * kWindow;
      Lanes sum = rows[c] * column[c];
      Lanes other = {};
      for (int r = c + 1; r < kBorder; ++r) sum -= column[r] * rows[r];
      if (batch.has_start) {
        for (int r = 0; r < kTerminalSize; ++r) other += column[kBorder + r] * numbers[r];
      }
      rows[c] = sum - other;
    }
  }
}

}  // namespace limber::rods::detail
