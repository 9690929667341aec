#pragma once

#include <optional>

#include "engine/rods/section/profile.h"

namespace limber::rods {

/// The torsion constant J of Saint-Venant's problem: torque = G J times twist per length.
struct Torsion {
  double constant = 0;        // [length^4]
  double relative_error = 0;  // estimate: change from the next coarser discretisation
  int unknowns = 0;           // of the finest discretisation
  /// Largest shear strain per twist per length [length], to about a thousandth. It is found on the
  /// boundary, at the discretisation's points; given for convex profiles only: at re-entrant
  /// corners it has no bound.
  std::optional<double> shear = {};
};

/// Whether `torsion` would be too large a problem, without solving it.
/// @pre the profile is valid
/// @throws Error{kLimitExceeded, "section.outer"}
void demand_torsion_size(const Profile& profile);

/// Any profile, thin or thick, with corners and holes. Solves for the warping function psi on the
/// boundary,
///   laplace psi = 0, d psi/d n = y n_x - x n_y, J = I_p - boundary integral of psi d psi/d n
/// by Green's formula. Panels of Gauss points shrink towards corners and close walls. No mesh of
/// the inside is needed, and the singularities of re-entrant corners cost a few more panels.
/// @throws Error as Profile::validate; Error{kNumerical} if the estimate stays above 1e-6 (walls
/// thinner than about a thousandth of their length: use sections with formulas of their own)
[[nodiscard]] Torsion torsion(const Profile& profile);

}  // namespace limber::rods
