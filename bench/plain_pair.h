#pragma once

#include <functional>
#include <string>

#include "bench/suite.h"

namespace limber::bench {

/// The same answer found in two ways: by limber, and as one would write it down.
struct PlainPair {
  std::string name;
  std::string ours, plain;  // the timed methods, in words
  /// Each does the whole work and returns a number that tells the answer (an energy, a norm).
  std::function<double()> run_ours, run_plain;
  double same = 1e-6;  // relative difference up to which the answers count as the same
};

/// Times both sides in turn, so that a slow spell of the machine meets both. Measures CPU time of
/// the process, as many calls in a row as last 20 ms; the ratio is the median over the rounds of
/// plain over ours.
/// @param rounds  >= 1, after one that is not counted
/// @throws std::runtime_error where the answers differ by more than `same`: then a ratio of times
/// means nothing
[[nodiscard]] Case measure_pair(const PlainPair& pair, int rounds);

}  // namespace limber::bench
