#include "engine/beams/results/beam_results.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/index.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams {

namespace {

NaturalModes<double> modes_of(const BeamStructure& structure, const ElementEnds& ends, int e) {
  return {structure.constants(e), vec(ends.finish - ends.start), triad(ends.start_axes),
          triad(ends.finish_axes)};
}

void read_element(const BeamStructure& structure, const BeamState& state, int e,
                  const ElementForceDistribution& distribution, BeamResults& results) {
  const NaturalModes<double> q = modes_of(structure, structure.ends(state, e), e);
  const ElementEnergies<double> energies(structure.constants(e), q);
  const BeamElement& element = structure.model().elements[index(e)];
  const BeamSection& section = structure.model().sections[index(element.section)];
  const ElementExtremes extremes = extremes_of(distribution);
  const GoverningStresses governing = governing_stresses(distribution, section, extremes);
  results.extremes.push_back(extremes);
  results.forces.push_back(element_forces(extremes, distribution.at(0), distribution.at(1)));
  results.stresses.push_back(governing.stresses);
  results.governing_places.push_back(governing.place);
  results.element_energies.push_back(energies.total());
  results.energies.stretching += energies.stretching;
  results.energies.torsion += energies.torsion;
  results.energies.bending_2 += energies.bending_2;
  results.energies.bending_3 += energies.bending_3;
  results.largest_utilisation =
      std::max(results.largest_utilisation, governing.stresses.utilisation);
  if (element.kind == BeamKind::kBeam) {
    const double least = std::clamp(std::min(q.start.c, q.finish.c), -1.0, 1.0);
    results.largest_bend = std::max(results.largest_bend, std::acos(least));
  }
}

}  // namespace

double strain_force(const BeamStructure& structure, const BeamState& state, int element) {
  return structure.constants(element).stretching *
         modes_of(structure, structure.ends(state, element), element).stretch;
}

ElementForces element_forces(const ElementExtremes& extremes, const SectionForces& start,
                             const SectionForces& finish) {
  ElementForces forces;
  forces.axial = extremes[0].peak();
  forces.torque = extremes[1].peak();
  forces.shear_2 = extremes[2].peak();
  forces.shear_3 = extremes[3].peak();
  forces.start_moment_2 = start.moment_2;
  forces.start_moment_3 = start.moment_3;
  forces.finish_moment_2 = finish.moment_2;
  forces.finish_moment_3 = finish.moment_3;
  return forces;
}

BeamResults results_of(const BeamStructure& structure, const BeamState& state) {
  BeamResults results;
  const NodeLoads loads = NodeLoads::of(structure.model());
  std::vector<ElementForceDistribution> distributions;
  std::vector<int> first_part(1, 0);
  for (int e = 0; e < structure.elements(); ++e) {
    read_element(structure, state, e, distributions.emplace_back(structure, loads, state, e),
                 results);
    first_part.push_back(e + 1);
  }
  results.distributions = {std::move(distributions), std::move(first_part)};
  const Eigen::VectorXd missing =
      elastic_gradient(structure, state) - load_vector(structure, loads, state);
  results.reaction_forces.setZero(3, structure.nodes());
  results.reaction_moments.setZero(3, structure.nodes());
  for (int i = 0; i < structure.nodes(); ++i) {
    const Eigen::Matrix3d spins = structure.spin_axes(i, state.rotations[index(i)]);
    for (int k = 0; k < 3; ++k) {
      if (structure.held()[index(6 * i + k)] != 0)
        results.reaction_forces.col(i) += missing[6 * i + k] * structure.node_axes(i).col(k);
      if (structure.held()[index(6 * i + 3 + k)] != 0)
        results.reaction_moments.col(i) += missing[6 * i + 3 + k] * spins.col(k);
    }
  }
  return results;
}

}  // namespace limber::beams
