#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bench/suite.h"
#include "engine/rods/linkage/linkage_model.h"

namespace limber::bench {

/// Source of rest lengths.
enum class RestLengthChoice { kDrawn, kSolved };

/// A linkage of the public data, and the public code's measurements of it.
struct LinkageCase {
  const char* name;
  const char* file;
  int edges;
  rods::RodStiffness stiffness;  // in N and mm
  int held;                      // joint whose position and rotation stay
  double target;                 // mean opening angle [degrees]
  int steps;
  RestLengthChoice rest_lengths;
  double known_closed;  // energy of the public code before opening, 0: none
  double known_energy;  // and deployed, with these rest lengths
  double known_ms;      // per iteration, public code
  double known_wall;    // [s]
};

[[nodiscard]] const std::vector<LinkageCase>& linkage_cases();
/// The one of this name, which there is.
[[nodiscard]] const LinkageCase& linkage_case(std::string_view name);
/// Lines of a linkage of the public data; nothing, and a note that `name` is left out, where they
/// are not there.
[[nodiscard]] std::optional<std::string> find_linkage_lines(const SuiteOptions& options,
                                                            const std::string& name,
                                                            const std::string& file,
                                                            Recorder& recorder);

}  // namespace limber::bench
