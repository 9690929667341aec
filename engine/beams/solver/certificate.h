#pragma once

#include <string>

#include "engine/base/job.h"
#include "engine/beams/solver/beam_solution.h"
#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams::detail {

/// "node 7 moves", "the start of element 3 turns".
[[nodiscard]] std::string location_text(const BeamStructure& structure, int unknown);

/// Status, node and message of a solve that ended so, by the largest unknown of the direction that
/// moves or is left; -1: none.
void report_status(const BeamStructure& structure, BeamStatus status, int unknown,
                   BeamReport& report);

/// The directions of a family of equilibria that a balanced state belongs to, in words too.
/// @param neutral  columns by all unknowns; none: nothing changes
void report_neutral(const BeamStructure& structure, const BeamState& state,
                    const Eigen::MatrixXd& neutral, BeamReport& report);

/// Does any of the moments act on a node that may turn about more than one axis?
[[nodiscard]] bool turns_free_nodes(const BeamStructure& structure,
                                    const Eigen::Matrix3Xd& moments);

/// Is a balanced state a minimum? Changes the status of a report that says converged where it is a
/// saddle (kUnstable) or something moves without resistance (kMechanism). Following loads, and
/// moments of fixed direction on nodes that turn about several axes, have no potential. Divergence
/// is then the only criterion, and the message says so.
void certify(const BeamStructure& structure, const JobContext& context, const NodeLoads& loads,
             const BeamState& state, BeamReport& report);

/// Changes the status of a report that says converged to kStalled if forces balance within
/// tolerance and rounding, but a Newton step would still turn something by more than
/// NewtonSolver::kResolvedTurn. Stiff parts hide the motion of soft ones. Not judged under loads
/// without a potential.
void resolve(const BeamStructure& structure, const JobContext& context, const NodeLoads& loads,
             const BeamState& state, double tolerance, BeamReport& report);

}  // namespace limber::beams::detail
