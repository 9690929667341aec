#pragma once

#include <vector>

#include "engine/scene/scene.h"

namespace limber::scene {

inline constexpr int kMaxStepsPerFrame = 10'000;

/// Everything that is wrong with a scene's simulation, each with its field
/// ("simulation.forces[1].nodes[0]"); empty if it has none.
[[nodiscard]] std::vector<Issue> simulation_issues(const Scene& scene);

}  // namespace limber::scene
