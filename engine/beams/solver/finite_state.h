#pragma once

#include <algorithm>

#include "engine/beams/structure/beam_state.h"

namespace limber::beams::detail {

[[nodiscard]] inline bool is_finite(const BeamState& state) {
  const auto all_finite = [](const std::vector<Eigen::Quaterniond>& turns) {
    return std::all_of(turns.begin(), turns.end(),
                       [](const Eigen::Quaterniond& q) { return q.coeffs().allFinite(); });
  };
  return state.positions.allFinite() && all_finite(state.rotations) &&
         all_finite(state.hinge_turns);
}

}  // namespace limber::beams::detail
