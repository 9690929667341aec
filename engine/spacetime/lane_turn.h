#pragma once

#include <Eigen/Core>

#include "engine/spacetime/lanes.h"

namespace limber::spacetime {

/// One number of each of kLaneWidth lanes.
using LanePacket = Eigen::Array<double, kLaneWidth, 1>;

[[nodiscard]] inline LanePacket load_lanes(const double* from) {
  return Eigen::Map<const LanePacket>(from);
}
inline void store_lanes(const LanePacket& packet, double* to) {
  Eigen::Map<LanePacket> lanes(to);
  lanes = packet;
}

/// The Givens rotation of two rows that takes a column from the second: `own` becomes `length`,
/// `other` zero. If both are zero, the rotation is the identity, `inverse` (of the length) is zero
/// and `is_zero` is one. There is no branch: square roots of the standard library and comparisons
/// would keep the compiler from vector instructions.
struct LaneTurn {
  LaneTurn(const LanePacket& own, const LanePacket& other) {
    constexpr double kTiny = 1e-300;  // below the square of any number that counts
    const LanePacket square = own * own + other * other;
    const LanePacket reciprocal = 1 / (square + kTiny);
    length = square.sqrt();
    inverse = length * reciprocal;
    is_zero = kTiny * reciprocal;
    cosine = own * inverse + is_zero;
    sine = other * inverse;
  }
  LanePacket length, inverse, is_zero, cosine, sine;
};

}  // namespace limber::spacetime
