#pragma once

#include <string>

#include "bench/linkage_models.h"
#include "engine/rods/design/linkage_design.h"

namespace limber::bench {

/// A linkage that designs begin from, and what holds its two shapes.
struct DesignProblem {
  rods::LinkageModel model;
  rods::Conditions flat, deployed;
  rods::DesignPoint start;
};

/// @param path  of the linkage's drawing
[[nodiscard]] DesignProblem open_design(const LinkageCase& named, const std::string& path);

/// A design that is known: both equilibria followed from the start.
struct KnownDesign {
  rods::DesignPoint point;
  bool found = true;
};

/// Lies flat as the start does.
/// @param share  by which rest lengths differ from the start's, at most
[[nodiscard]] KnownDesign known_design(const DesignProblem& problem, double share);

}  // namespace limber::bench
