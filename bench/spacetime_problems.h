#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/suite.h"
#include "engine/reduced/reduced_model.h"
#include "engine/spacetime/problem.h"

namespace limber::bench {

/// A constraint before sites are known to any kinematics.
struct NodeConstraint {
  std::vector<int> nodes;  // compact
  spacetime::PositionConstraint constraint;
};

struct SpacetimeProblem {
  std::string scene;
  int tets = 0;
  std::shared_ptr<const reduced::ReducedModel> model;
  spacetime::ModeDynamics dynamics;
  spacetime::Timeline timeline;
  std::vector<NodeConstraint> constraints;
};

/// The sample scene: N = 380, r = 30, h = 80, its 20 constraints.
[[nodiscard]] SpacetimeProblem flower_problem(Recorder& recorder);

/// 27 constraints on three nodes in turn, on the path of a random smooth motion of the model's own
/// modes (largest displacement near a quarter of the body), each off it by up to 0.3 % of the body.
/// Empty without the public data.
[[nodiscard]] std::optional<SpacetimeProblem> tyrannosaurus_problem(const SuiteOptions& options,
                                                                    Recorder& recorder);

}  // namespace limber::bench
