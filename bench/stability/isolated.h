#pragma once

#include <functional>

#include "bench/stability/verdict.h"

namespace limber::bench::stability {

/// Runs work in a process of its own, so that neither a hang nor a crash ends the suite. The child
/// is killed at the limit.
/// @pre this process has no threads of the engine: it never ran any
/// @param limit  wall time [s]
/// @throws std::runtime_error where no process could be made
[[nodiscard]] Ended run_isolated(const std::function<Finding()>& work, double limit);

}  // namespace limber::bench::stability
