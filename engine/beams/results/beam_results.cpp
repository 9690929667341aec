#include "engine/beams/results/beam_results.h"

#include <algorithm>
#include <cmath>

#include "engine/base/index.h"
#include "engine/beams/structure/node_loads.h"

namespace limber::beams {

namespace {

ElementForces forces_of(const ElementResponse<double>& r, double chord) {
  ElementForces f;
  f.axial = r.axial;
  f.torque = r.twisting;
  // Angles of the start count against the curvature, those of the finish with it.
  f.start_moment_2 = -r.start_2;
  f.start_moment_3 = -r.start_3;
  f.finish_moment_2 = r.finish_2;
  f.finish_moment_3 = r.finish_3;
  // The couple of the shears balances the moments.
  f.shear_3 = (r.start_2 + r.finish_2) / chord;
  f.shear_2 = -(r.start_3 + r.finish_3) / chord;
  return f;
}

double bending_stress(const BeamSection& s, double moment_2, double moment_3) {
  double stress = 0;
  if (s.bending_2 > 0) stress += std::abs(moment_2) * s.fibre_3 / s.bending_2;
  if (s.bending_3 > 0) stress += std::abs(moment_3) * s.fibre_2 / s.bending_3;
  return s.young * stress;
}

ElementStresses stresses_of(const BeamSection& s, const ElementForces& f) {
  ElementStresses result;
  result.axial = s.young * f.axial / s.stretching;
  result.bending = std::max(bending_stress(s, f.start_moment_2, f.start_moment_3),
                            bending_stress(s, f.finish_moment_2, f.finish_moment_3));
  if (s.torsion > 0) result.torsion = s.shear * std::abs(f.torque) * s.shear_arm / s.torsion;
  const double normal = std::abs(result.axial) + result.bending;
  result.equivalent = std::sqrt(normal * normal + 3 * result.torsion * result.torsion);
  if (s.yield_stress > 0) result.utilisation = result.equivalent / s.yield_stress;
  return result;
}

void read_element(const BeamStructure& structure, const BeamState& state, int e,
                  BeamResults& results) {
  const ElementConstants<double>& k = structure.constants(e);
  const ElementEnds ends = structure.ends(state, e);
  const Triad<double> a = triad(ends.start_axes), b = triad(ends.finish_axes);
  const NaturalModes<double> q(k, vec(ends.finish - ends.start), a, b);
  const ElementResponse<double> r(k, q, a, b);
  const ElementEnergies<double> energies(k, q);
  const BeamElement& element = structure.model().elements[index(e)];
  results.forces.push_back(forces_of(r, q.chord));
  results.stresses.push_back(
      stresses_of(structure.model().sections[index(element.section)], results.forces.back()));
  results.element_energies.push_back(energies.total());
  results.energies.stretching += energies.stretching;
  results.energies.torsion += energies.torsion;
  results.energies.bending_2 += energies.bending_2;
  results.energies.bending_3 += energies.bending_3;
  results.largest_utilisation =
      std::max(results.largest_utilisation, results.stresses.back().utilisation);
  if (element.kind == BeamKind::kBeam) {
    const double least = std::clamp(std::min(q.start.c, q.finish.c), -1.0, 1.0);
    results.largest_bend = std::max(results.largest_bend, std::acos(least));
  }
}

}  // namespace

BeamResults results_of(const BeamStructure& structure, const BeamState& state) {
  BeamResults results;
  for (int e = 0; e < structure.elements(); ++e) read_element(structure, state, e, results);
  const Eigen::VectorXd missing = elastic_gradient(structure, state) -
                                  load_vector(structure, NodeLoads::of(structure.model()), state);
  results.reaction_forces.setZero(3, structure.nodes());
  results.reaction_moments.setZero(3, structure.nodes());
  for (int i = 0; i < structure.nodes(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d axis = structure.node_axes(i).col(k);
      if (structure.held()[index(6 * i + k)] != 0)
        results.reaction_forces.col(i) += missing[6 * i + k] * axis;
      if (structure.held()[index(6 * i + 3 + k)] != 0)
        results.reaction_moments.col(i) += missing[6 * i + 3 + k] * axis;
    }
  }
  return results;
}

}  // namespace limber::beams
