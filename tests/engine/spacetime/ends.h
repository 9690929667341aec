#pragma once

#include <ostream>
#include <vector>

#include "engine/spacetime/problem.h"

namespace limber::spacetime {

constexpr EndCondition kEnds[] = {EndCondition::kFree, EndCondition::kPinnedPosition,
                                  EndCondition::kPinnedPositionVelocity};

/// A parameter of tests that all pairs of ends have to pass; prints as what a test can be called.
struct Ends {
  EndCondition first, last;
};

inline std::ostream& operator<<(std::ostream& out, const Ends& ends) {
  const char* names[] = {"Free", "Position", "PositionVelocity", "Cyclic"};
  return out << names[static_cast<int>(ends.first)] << "To" << names[static_cast<int>(ends.last)];
}

/// Of the published form.
inline std::vector<Ends> open_ends() {
  std::vector<Ends> all;
  for (const EndCondition first : kEnds) {
    for (const EndCondition last : kEnds) all.push_back({first, last});
  }
  return all;
}

inline std::vector<Ends> all_ends() {
  std::vector<Ends> all = open_ends();
  all.push_back({EndCondition::kCyclic, EndCondition::kCyclic});
  return all;
}

}  // namespace limber::spacetime
