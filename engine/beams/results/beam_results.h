#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/beams/results/force_distribution.h"
#include "engine/beams/structure/beam_structure.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams {

/// Forces and moments in an element, by the axes of its sections: axial force, torque and shears
/// each where its size is largest, with its sign; moments at the ends.
struct ElementForces {
  double axial = 0;                               // N, tension is positive [force]
  double torque = 0;                              // [force length]
  double shear_2 = 0, shear_3 = 0;                // [force]
  double start_moment_2 = 0, start_moment_3 = 0;  // EI times curvature beyond rest [force length]
  double finish_moment_2 = 0, finish_moment_3 = 0;
};

struct BeamResults {
  /// Balancing forces of supports and motions, in global axes, a column per node; zero where
  /// nothing is held.
  Eigen::Matrix3Xd reaction_forces, reaction_moments;
  std::vector<ElementForces> forces;
  std::vector<ElementExtremes> extremes;
  std::vector<ElementStresses> stresses;  // where the equivalent one is largest along the element
  std::vector<double> governing_places;   // where that is: share of the length at rest
  ForceDistributions distributions;
  std::vector<double> element_energies;  // [force length]
  BeamEnergies energies;
  double largest_utilisation = 0;
  double largest_bend = 0;  // angle between an end and the chord [rad]: above 0.5, too coarse
};

/// Everything that is read off a state in balance with the loads of the structure's model.
[[nodiscard]] BeamResults results_of(const BeamStructure& structure, const BeamState& state);

/// EA times the strain of an element: its axial force, where loads are over it the mean of that
/// [force].
[[nodiscard]] double strain_force(const BeamStructure& structure, const BeamState& state,
                                  int element);

/// Forces and moments of an element whose extremes are known.
[[nodiscard]] ElementForces element_forces(const ElementExtremes& extremes,
                                           const SectionForces& start, const SectionForces& finish);

}  // namespace limber::beams
