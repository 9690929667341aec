#pragma once

#include <Eigen/Core>
#include <array>

#include "engine/beams/model/section.h"

namespace limber::beams {

/// Forces and moments at a place of an element: action of the part behind a cut on the part before
/// it, by the axes of the section there.
struct SectionForces {
  double axial = 0;                   // N, tension is positive [force]
  double torque = 0;                  // [force length]
  double shear_2 = 0, shear_3 = 0;    // [force]
  double moment_2 = 0, moment_3 = 0;  // EI times curvature beyond rest [force length]

  static constexpr int kComponents = 6;
  /// In the order of the members.
  [[nodiscard]] std::array<double, kComponents> components() const {
    return {axial, torque, shear_2, shear_3, moment_2, moment_3};
  }
};

/// Stresses at a place of an element [force/length^2]; 0 if the section lacks the data for them.
struct ElementStresses {
  double axial = 0;        // N/A, signed
  double bending = 0;      // of both planes together, the largest on the outline of the section
  double torsion = 0;      // shear
  double equivalent = 0;   // von Mises: sqrt((|axial| + bending)^2 + 3 torsion^2)
  double utilisation = 0;  // equivalent over yield stress
};

/// For a round section the largest bending stress is that of the resultant moment, about whatever
/// axis it is. Otherwise both moments are largest in a corner.
[[nodiscard]] ElementStresses stresses_of(const BeamSection& section, const SectionForces& forces);

}  // namespace limber::beams
