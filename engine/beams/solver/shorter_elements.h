#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/job.h"
#include "engine/beams/structure/beam_structure.h"

namespace limber::beams::detail {

/// Judgement by shorter elements of a balanced state that its own elements call stable.
struct ShorterElements {
  enum class Result {
    kStable,
    kUnstable,   // cut into parts, elements buckle
    kNotJudged,  // no equilibrium of the shorter elements was found beside the state
  };
  Result result = Result::kNotJudged;
  std::vector<int> elements;  // that buckle, or are not judged
  int parts = 0;              // into which the first of them was cut
  int node = -1;              // that buckles most, or the nearest of the structure
  std::string message;        // a sentence for people; empty where all is well
};

/// Elements that are pressed, twisted or bent about their stiff axis so much that they buckle
/// visibly too late are cut, and the equilibrium of the parts is judged.
///
/// An element is a cubic: by itself it buckles late by p^2 / 450, p = N L^2 / EI its compression,
/// and not at all between clamps. Torque makes it buckle late by 0.09 times its squared twist.
/// @returns nothing where no element is pressed, twisted or bent so much
[[nodiscard]] std::optional<ShorterElements> look_with_shorter_elements(
    const BeamStructure& structure, const BeamState& state, const JobContext& context);

}  // namespace limber::beams::detail
