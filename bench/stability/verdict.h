#pragma once

#include <optional>
#include <string>

#include "bench/stability/sweep.h"

namespace limber::bench::stability {

/// How a row ended, independent of its numbers.
enum class End {
  kAnswered,
  kRefused,  // with an Error, whose message says why
  kThrew,    // anything else
  kHung,     // no end within the wall limit
  kCrashed,  // the process died
};

struct Ended {
  End end = End::kCrashed;
  Finding finding = {};      // of kAnswered
  std::string message = {};  // of all others
  double seconds = 0;        // wall time
};

enum class Outcome {
  kCertified,  // claimed, and found right by the check
  kSaidSo,     // not claimed, with a reason
  kRefused,    // with a reason
  kWrong,      // claimed, and refuted; or not finite; or nothing was said
  kHung,
  kCrashed,
};
/// As the rows have it.
[[nodiscard]] const char* to_string(Outcome outcome) noexcept;

/// No row may have one of these.
[[nodiscard]] bool is_fault(Outcome outcome) noexcept;

struct Verdict {
  Outcome outcome = Outcome::kWrong;
  std::optional<double> error;   // of an answer, where it is finite
  std::optional<double> margin;  // allowed / error, of certified rows; error at least 1e-16
  std::string reason;            // the answer's own words, or its fault
};

[[nodiscard]] Verdict verdict_of(const Ended& ended);

}  // namespace limber::bench::stability
