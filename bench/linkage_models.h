#pragma once

#include <vector>

#include "engine/rods/linkage/linkage_model.h"

namespace limber::bench {

/// Where rest lengths come from.
enum class RestLengthChoice { kDrawn, kSolved };

/// A linkage of the public data, and what the public code measured on it.
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

}  // namespace limber::bench
