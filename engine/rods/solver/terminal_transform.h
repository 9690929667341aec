#pragma once

#include "engine/rods/solver/chain_elimination.h"

// From the numbers that joints determine to the joints' unknowns, four chains at a time.

namespace limber::rods::detail {

/// J of one end: kTerminalSize x kJointSize, by rows.
using TerminalLanes = Lanes[kTerminalSize * kJointSize];
/// A 9 x 9 block, column-major.
using BlockLanes = Lanes[kJointSize * kJointSize];

/// out = J^T S J on and below the diagonal; the rest of out is not written.
/// @param s  [column][row], lower triangle
template <class Matrix>
inline void transform_own(const Matrix& s, int offset, const Lanes* j, Lanes* out) {
  for (int c = 0; c < kJointSize; ++c) {
    Lanes product[kTerminalSize];
    for (int r = 0; r < kTerminalSize; ++r) {
      Lanes sum = {};
      for (int k = 0; k < kTerminalSize; ++k) {
        const int low = k < r ? k : r;
        const int high = k < r ? r : k;
        sum += s[offset + low][offset + high] * j[k * kJointSize + c];
      }
      product[r] = sum;
    }
    for (int r = c; r < kJointSize; ++r) {
      Lanes sum = {};
      for (int k = 0; k < kTerminalSize; ++k) sum += j[k * kJointSize + r] * product[k];
      out[c * kJointSize + r] = sum;
    }
  }
}

/// out = J_start^T S J_finish.
/// @param s  [column of finish][row of start]
template <class Matrix>
inline void transform_coupling(const Matrix& s, int row_offset, const Lanes* start,
                               const Lanes* finish, Lanes* out) {
  for (int c = 0; c < kJointSize; ++c) {
    Lanes product[kTerminalSize];
    for (int r = 0; r < kTerminalSize; ++r) {
      Lanes sum = {};
      for (int k = 0; k < kTerminalSize; ++k)
        sum += s[k][row_offset + r] * finish[k * kJointSize + c];
      product[r] = sum;
    }
    for (int r = 0; r < kJointSize; ++r) {
      Lanes sum = {};
      for (int k = 0; k < kTerminalSize; ++k) sum += start[k * kJointSize + r] * product[k];
      out[c * kJointSize + r] = sum;
    }
  }
}

}  // namespace limber::rods::detail
