#include "engine/beams/refinement/member_results.h"

#include "engine/base/index.h"

namespace limber::beams {

BeamResults member_results(const BeamResults& results, const Subdivision& subdivision) {
  if (subdivision.is_whole()) return results;
  BeamResults gathered;
  const int nodes = subdivision.given_nodes();
  gathered.reaction_forces = results.reaction_forces.leftCols(nodes);
  gathered.reaction_moments = results.reaction_moments.leftCols(nodes);
  gathered.energies = results.energies;
  gathered.largest_utilisation = results.largest_utilisation;
  gathered.largest_bend = results.largest_bend;
  for (int e = 0; e < static_cast<int>(subdivision.parts().size()); ++e) {
    const int first = subdivision.first_part(e), parts = subdivision.parts_of(e);
    const ElementForces& last = results.forces[index(first + parts - 1)];
    ElementForces forces = results.forces[index(first)];
    ElementStresses stresses = results.stresses[index(first)];
    double energy = results.element_energies[index(first)];
    for (int i = 1; i < parts; ++i) {
      const ElementForces& part = results.forces[index(first + i)];
      forces.axial += part.axial;
      forces.torque += part.torque;
      forces.shear_2 += part.shear_2;
      forces.shear_3 += part.shear_3;
      energy += results.element_energies[index(first + i)];
      if (results.stresses[index(first + i)].equivalent > stresses.equivalent)
        stresses = results.stresses[index(first + i)];
    }
    for (double* const mean : {&forces.axial, &forces.torque, &forces.shear_2, &forces.shear_3})
      *mean /= parts;
    forces.finish_moment_2 = last.finish_moment_2;
    forces.finish_moment_3 = last.finish_moment_3;
    gathered.forces.push_back(forces);
    gathered.stresses.push_back(stresses);
    gathered.element_energies.push_back(energy);
  }
  return gathered;
}

}  // namespace limber::beams
