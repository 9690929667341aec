#pragma once

#include "bench/spacetime_problems.h"
#include "bench/suite.h"

namespace limber::bench {

struct PathShape {
  int frames = 0, constraints = 0;
  int modes = 0;        // r: coordinates that are optimised, of the model's first
  double reach = 0.25;  // largest displacement of a target, about, in body lengths
  double period = 40;   // frames of one swing of the first mode
};

/// Constraints on three nodes in turn, on the path of a smooth motion of the model's first six
/// modes: the same for every run. They are spread over the time line but for its outer tenths.
[[nodiscard]] SpacetimeProblem path_problem(const NamedBody& named,
                                            std::shared_ptr<const reduced::ReducedModel> model,
                                            const PathShape& shape);

}  // namespace limber::bench
