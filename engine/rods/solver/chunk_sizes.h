#pragma once

#include <cstdint>

namespace limber::rods::detail {

// Work that one thread takes at a time from a parallel loop: a few microseconds, since sharing a
// loop costs one while threads spin for the next. Measured on two cores; halves and doubles of
// these numbers made no difference.
inline constexpr std::int64_t kBatchesPerChunk = 4;  // of chains, kLanes each
inline constexpr std::int64_t kJointsPerChunk = 16;

}  // namespace limber::rods::detail
