#pragma once

namespace limber::processor {

/// Instruction sets of x86-64 that code may be compiled for and not every processor has. Processors
/// with these have the rest of their level, too (LZCNT, MOVBE, F16C).
enum Set : unsigned {
  kSse3 = 1U << 0,
  kSsse3 = 1U << 1,
  kSse41 = 1U << 2,
  kSse42 = 1U << 3,
  kPopcnt = 1U << 4,
  kAvx = 1U << 5,
  kAvx2 = 1U << 6,
  kBmi = 1U << 7,
  kBmi2 = 1U << 8,
  kFma = 1U << 9,
  kAvx512f = 1U << 10,
  kAvx512bw = 1U << 11,
  kAvx512cd = 1U << 12,
  kAvx512dq = 1U << 13,
  kAvx512vl = 1U << 14,
};

/// Those that this build was compiled for. A constant: to read it takes none of them.
extern const unsigned needed;

}  // namespace limber::processor
