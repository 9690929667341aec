#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace limber::rods {

/// A row of 4 n + 3 numbers x_0, theta_0, x_1, theta_1, .., theta_(n-1), x_n (positions of three).
/// A joint at the start determines the first seven, a joint at the finish the last seven; the
/// others are unknowns of their own.
struct Chain {
  int edges;         // n
  int start_joint;   // -1: free
  int finish_joint;  // -1: free

  friend bool operator==(const Chain&, const Chain&) = default;
};

inline constexpr std::ptrdiff_t kChainLanes = 4;    // chains of equal shape side by side
inline constexpr std::ptrdiff_t kTerminalSize = 7;  // numbers that a joint determines at an end
inline constexpr std::ptrdiff_t kJointSize = 9;     // unknowns of a joint
inline constexpr std::ptrdiff_t kBandHeight =
    11;  // entries of a band column: the diagonal and 10 below
inline constexpr std::ptrdiff_t kChainBlock = 4;  // unknowns that are eliminated together

/// Up to four chains with the same number of edges and the same kinds of ends.
struct ChainBatch {
  int edges;
  bool has_start;
  bool has_finish;
  std::array<int, kChainLanes> chains;  // -1: an empty lane
  std::size_t band;                     // offset of this batch's band, in lanes
  std::size_t factor;                   // offset of its eliminated columns, in lanes
  std::size_t work;                     // offset of its right-hand side, in lanes

  [[nodiscard]] int numbers() const { return 4 * edges + 3; }
  /// First and one past the last number that is no joint's.
  [[nodiscard]] int begin() const { return has_start ? kTerminalSize : 0; }
  [[nodiscard]] int end() const { return numbers() - (has_finish ? kTerminalSize : 0); }
  /// Blocks of x_i, theta_i that hold unknowns; the first after a joint holds theta_1 only.
  [[nodiscard]] int first_block() const { return has_start ? 1 : 0; }
  [[nodiscard]] int end_block() const { return has_finish ? edges - 1 : edges + 1; }
};

/// Which unknowns of a linkage couple: chains between joints. The reduced vector holds each chain's
/// unknowns in turn, then nine for each joint.
class ChainBatches {
 public:
  /// @pre edges >= 1 + number of joints of the chain, joints in range and different
  ChainBatches(std::vector<Chain> chains, int joints);

  [[nodiscard]] const std::vector<Chain>& chains() const { return chains_; }
  [[nodiscard]] const std::vector<ChainBatch>& batches() const { return batches_; }
  [[nodiscard]] int joints() const { return joints_; }
  [[nodiscard]] int size() const { return chain_begin_.back() + kJointSize * joints_; }
  [[nodiscard]] int chain_begin(int chain) const { return chain_begin_[chain]; }
  [[nodiscard]] int chain_size(int chain) const {
    return chain_begin_[chain + 1] - chain_begin_[chain];
  }
  [[nodiscard]] int joint_begin(int joint) const {
    return chain_begin_.back() + kJointSize * joint;
  }

  /// Place of a chain in the batches.
  struct Place {
    int batch;
    int lane;
  };
  [[nodiscard]] Place place(int chain) const { return places_[chain]; }

  [[nodiscard]] std::size_t band_lanes() const { return band_lanes_; }
  [[nodiscard]] std::size_t factor_lanes() const { return factor_lanes_; }
  [[nodiscard]] std::size_t work_lanes() const { return work_lanes_; }

 private:
  std::vector<Chain> chains_;
  int joints_;
  std::vector<ChainBatch> batches_;
  std::vector<Place> places_;
  std::vector<int> chain_begin_;
  std::size_t band_lanes_ = 0, factor_lanes_ = 0, work_lanes_ = 0;
};

}  // namespace limber::rods
