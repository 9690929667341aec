#pragma once

#include <cstdint>

namespace limber::session {

/// Which exact answers are compared with optima from further starts, and how many of these.
struct StartSearchOptions {
  int starts = 6;  // in addition to the shown motion, >= 1
  /// Targets must reach so far from rest [body lengths], >= 0: small motions have one optimum.
  double least_reach = 0.3;
  // Larger scenes are left alone, since a start would take minutes. All >= 0.
  int most_tets = 20'000;
  int most_frames = 5'000;
  int most_constraints = 24;
  /// Limit of a search, in solves times frames times tets, >= 0: fewer orders are tried if all of
  /// them exceed it. Ten times what 4 constraints in 129 frames of 2,000 tets take.
  std::int64_t most_work = 54'180'000;

  /// @throws Error{kInvalidArgument} naming the member, its value and the inequality
  void validate() const;
  /// Starts that `most_work` allows, at most `starts`: one solve with all constraints at once, and
  /// one for each constraint in every further start. 0 where it allows no further one.
  /// @param constraints, frames, tets  >= 1
  [[nodiscard]] int starts_within(int constraints, int frames, int tets) const;
};

/// Further starts of one problem.
struct StartComparison {
  int compared = 0;          // that ended in a motion, the shown one among them
  int unconverged = 0;       // of these, without convergence: no optima
  int optima = 0;            // different ones among those that converged
  int budget = 0;            // starts that are allowed, the shown motion among them
  double lowest_energy = 0;  // total energies
  double highest_energy = 0;
  double largest_distance = 0;  // of a node between the best motion and another one [m]
};

}  // namespace limber::session
