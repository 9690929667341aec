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

/// The problem's constraints on sites of these kinematics, which get them.
[[nodiscard]] std::vector<spacetime::PositionConstraint> place_constraints(
    const SpacetimeProblem& problem, reduced::ReducedKinematics& kinematics);

/// A sample scene with its own constraints and time line, r = 30, h = 80 (flower: N = 380, 20
/// constraints).
/// @param coordinates  R >= 30, columns of W-hat
[[nodiscard]] SpacetimeProblem sample_problem(const std::string& name, int coordinates,
                                              Recorder& recorder);

/// 27 constraints on three nodes in turn, on the path of a random smooth motion of the model's own
/// modes (largest displacement near a quarter of the body). Each is off it by up to 0.3 % of the
/// body. N = 350, r = 30, h = 80. Empty without the public data.
[[nodiscard]] std::optional<SpacetimeProblem> tyrannosaurus_problem(int coordinates,
                                                                    const SuiteOptions& options,
                                                                    Recorder& recorder);

}  // namespace limber::bench
