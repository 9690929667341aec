#pragma once

#include <vector>

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/structure/beam_structure.h"

namespace limber::beams {

/// The equilibrium of a structure under its loads, supports and motions, from the state as drawn.
///
/// Stops with BeamStatus::kCancelled and the state at hand where the job is cancelled.
/// @param observer  called from the working thread with states along the path; may be empty
/// @throws Error as BeamSolveOptions::validate
[[nodiscard]] BeamSolution find_equilibrium(const BeamStructure& structure,
                                            const BeamSolveOptions& options = {},
                                            const JobContext& context = {},
                                            const BeamObserver& observer = {});

/// The same from a given state of the same structure, for models whose loads or supports have
/// changed a little. Its unknowns are kept; held ones are brought to the values of their motions.
[[nodiscard]] BeamSolution find_equilibrium_from(const BeamStructure& structure,
                                                 const BeamState& start,
                                                 const BeamSolveOptions& options = {},
                                                 const JobContext& context = {},
                                                 const BeamObserver& observer = {});

/// Rotation of a held node.
struct HeldTurn {
  int node = 0;
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();  // rotation vector from rest [rad], any size
};

/// Conditions under which the state to begin at was found. An answer under the very same conditions
/// is begun at unchanged, so that it comes back to the last digit (start_shift() moves the others).
enum class FoundUnder { kOtherConditions, kTheseConditions };

/// Continues from a state of the same elements that was in balance with other loads, supports and
/// motions. The forces that keep it in balance fade while held nodes go to their targets. The
/// equilibria in between are therefore a branch that begins at the state.
/// @param turned  prescribed rotations there, for those of more than half a turn
/// @throws Error as BeamSolveOptions::validate
[[nodiscard]] BeamSolution follow_equilibrium(
    const BeamStructure& structure, const BeamState& start, const std::vector<HeldTurn>& turned,
    const BeamSolveOptions& options = {}, const JobContext& context = {},
    const BeamObserver& observer = {}, FoundUnder found = FoundUnder::kOtherConditions);

/// Do elements that are too long to show how they buckle hide that a balanced state is unstable?
/// Changes a report that says converged to kUnstable then; where that is not known its message says
/// so. Names the elements.
/// @param state, report  of the structure
void judge_by_shorter_elements(const BeamStructure& structure, const BeamState& state,
                               BeamReport& report, const JobContext& context = {});

}  // namespace limber::beams
