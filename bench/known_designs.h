#pragma once

#include <functional>
#include <string>

#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/rods/design/design_optimizer.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::bench {

/// Measures each linkage that there are public figures of, of those that $LIMBER_BENCH_ONLY
/// selects. Omitted and failed linkages are noted.
/// @param measure  gets the case and the path of its drawing
void for_each_design(
    const SuiteOptions& options, Recorder& recorder,
    const std::function<void(const LinkageCase& named, const std::string& path)>& measure);

/// A linkage that designs begin from, and the supports of its two shapes.
struct DesignProblem {
  rods::LinkageModel model;
  rods::Conditions flat, deployed;
  rods::DesignPoint start;
};

/// @param path  of the linkage's drawing
[[nodiscard]] DesignProblem open_design(const LinkageCase& named, const std::string& path);

inline constexpr double kPerturbed = 0.03;  // rest lengths of the known design

/// A design that is known: both equilibria followed from the start.
struct KnownDesign {
  rods::DesignPoint point;
  bool found = true;
};

/// Lies flat as the start does.
/// @param share  by which rest lengths differ from the start's, at most
[[nodiscard]] KnownDesign known_design(const DesignProblem& problem, double share);

/// At the start; the target is the deployed shape of the known design.
[[nodiscard]] rods::LinkageDesign design_towards(const KnownDesign& known,
                                                 const DesignProblem& problem);

/// How it is searched for: constraints that the start keeps with room to spare.
/// @param design  at the start
[[nodiscard]] rods::DesignOptimizerOptions known_search(rods::LinkageDesign& design, int steps);

}  // namespace limber::bench
