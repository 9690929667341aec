#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams {

/// Forces and moments in an element: what the part behind a cut does to the part before it, by the
/// axes of the end's section (axis 1 along the chord).
struct ElementForces {
  double axial = 0;                               // N, tension is positive [force]
  double torque = 0;                              // [force length]
  double shear_2 = 0, shear_3 = 0;                // [force]
  double start_moment_2 = 0, start_moment_3 = 0;  // EI times curvature beyond rest [force length]
  double finish_moment_2 = 0, finish_moment_3 = 0;
};

/// Largest stresses in an element, at its ends [force/length^2]; 0 where the section does not say
/// what they need.
struct ElementStresses {
  double axial = 0;        // N/A, signed
  double bending = 0;      // of both planes together, at the corner of the section
  double torsion = 0;      // shear
  double equivalent = 0;   // von Mises: sqrt((|axial| + bending)^2 + 3 torsion^2)
  double utilisation = 0;  // equivalent over yield stress
};

struct BeamResults {
  /// What supports and motions give for balance, in global axes, a column per node; zero where
  /// nothing is held.
  Eigen::Matrix3Xd reaction_forces, reaction_moments;
  std::vector<ElementForces> forces;
  std::vector<ElementStresses> stresses;
  std::vector<double> element_energies;  // [force length]
  BeamEnergies energies;
  double largest_utilisation = 0;
  double largest_bend = 0;  // angle between an end and the chord [rad]: above 0.5, too coarse
};

/// Everything that is read off a state in balance with the loads of the structure's model.
[[nodiscard]] BeamResults results_of(const BeamStructure& structure, const BeamState& state);

}  // namespace limber::beams
