#include "engine/beams/results/section_forces.h"

#include <cmath>

namespace limber::beams {

namespace {

double bending_stress(const BeamSection& s, double moment_2, double moment_3) {
  const double about_2 = s.bending_2 > 0 ? std::abs(moment_2) * s.fibre_3 / s.bending_2 : 0;
  const double about_3 = s.bending_3 > 0 ? std::abs(moment_3) * s.fibre_2 / s.bending_3 : 0;
  return s.young *
         (s.outline == Outline::kRound ? std::hypot(about_2, about_3) : about_2 + about_3);
}

}  // namespace

ElementStresses stresses_of(const BeamSection& section, const SectionForces& forces) {
  ElementStresses result;
  result.axial = section.young * forces.axial / section.stretching;
  result.bending = bending_stress(section, forces.moment_2, forces.moment_3);
  if (section.torsion > 0)
    result.torsion = section.shear * std::abs(forces.torque) * section.shear_arm / section.torsion;
  const double normal = std::abs(result.axial) + result.bending;
  result.equivalent = std::sqrt(normal * normal + 3 * result.torsion * result.torsion);
  if (section.yield_stress > 0) result.utilisation = result.equivalent / section.yield_stress;
  return result;
}

}  // namespace limber::beams
