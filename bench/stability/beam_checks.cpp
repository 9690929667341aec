#include "bench/stability/beam_checks.h"

#include <algorithm>
#include <cmath>

#include "engine/beams/structure/elastic.h"
#include "tests/support/beam_columns.h"

namespace limber::bench::stability {

using beams::BeamState;
using beams::BeamStructure;

Finding finding_of(const beams::BeamSolution& found) {
  Finding finding;
  finding.claim = found.report.converged() ? Claim::kConverged : Claim::kNotConverged;
  finding.is_finite =
      found.state.positions.allFinite() && std::isfinite(found.report.elastic_energy) &&
      std::all_of(found.state.rotations.begin(), found.state.rotations.end(),
                  [](const Eigen::Quaterniond& q) { return q.coeffs().allFinite(); });
  finding.message = found.report.message;
  return finding;
}

double imbalance_by_energy(const BeamStructure& structure, const BeamState& state) {
  Eigen::VectorXd loads = Eigen::VectorXd::Zero(structure.unknowns());
  for (const beams::NodalLoad& load : structure.model().loads)
    loads.segment<3>(6 * load.node) += structure.node_axes(load.node).transpose() * load.force;
  Eigen::VectorXd increments = Eigen::VectorXd::Zero(structure.unknowns());
  const auto energy = [&](int unknown, double by) {
    increments[unknown] = by;
    const double value = elastic_energies(structure, structure.moved(state, increments)).total();
    increments[unknown] = 0;
    return value;
  };
  const double length = structure.constants(0).length;
  double left = 0, present = 0;
  for (int u = 0; u < 6 * structure.nodes(); ++u) {
    // Forces and moments are compared as forces: moments over the length of an element.
    const double arm = u % 6 < 3 ? 1 : length;
    // Fourth order, since nearly inextensible beams stiffen fast.
    const double h = (u % 6 < 3 ? 1e-4 * length : 1e-4);
    const double slope =
        (8 * (energy(u, h) - energy(u, -h)) - (energy(u, 2 * h) - energy(u, -2 * h))) /
        (12 * h * arm);
    present = std::max({present, std::abs(slope), std::abs(loads[u] / arm)});
    if (structure.held()[static_cast<std::size_t>(u)] == 0)
      left = std::max(left, std::abs(slope - loads[u] / arm));
  }
  const Eigen::Matrix3Xd& places = state.positions;
  const double extent = (places.rowwise().maxCoeff() - places.rowwise().minCoeff()).norm();
  const double soft = structure.model().sections[0].bending_2 / (extent * extent);
  return left / std::max(present, 1e-3 * soft);
}

double minimum_error(const BeamStructure& structure, const BeamState& state) {
  if (testing::negative_by_differences(structure, state) > 0) return 1;
  return imbalance_by_energy(structure, state);
}

}  // namespace limber::bench::stability
