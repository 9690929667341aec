#pragma once

#include <set>
#include <string>
#include <vector>

#include "engine/session/bodies/mode_chooser.h"

namespace limber::session {

/// The state for which the number of modes was chosen: small edits do not repeat the choice.
struct ModeQuestion {
  std::set<std::vector<int>> groups;  // of nodes that sites are means of, compact
  std::size_t constraints = 0;
  spacetime::Timeline timeline;
  scene::Dynamics dynamics;
  double energy = 0;
};

/// @param energy  of the optimum
[[nodiscard]] ModeQuestion mode_question(const ModeProblem& problem, double energy);

/// Whether the answer to `before` is valid for `now`. It requires the same ends and dynamics, no
/// group of nodes that was not held then, at most twice and at least half as many constraints, and
/// an energy that has changed by no more than `energy_factor`.
[[nodiscard]] bool is_answered_by(const ModeQuestion& now, const ModeQuestion& before,
                                  double energy_factor);

}  // namespace limber::session
