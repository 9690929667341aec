#pragma once

#include <optional>

namespace limber::beams {

/// Material of a beam. Any consistent units; SI in files.
struct BeamMaterial {
  double young = 0;         // E [force/length^2], > 0
  double poisson = 0;       // in (-1, 0.5]; 0 where the shear modulus is given
  double density = 0;       // [mass/length^3], >= 0; 0: no self-weight
  double yield_stress = 0;  // [force/length^2], >= 0; 0: no utilisation
  /// G [force/length^2], > 0: of timber and other materials whose G does not follow from E. Without
  /// it G = E / (2 (1 + nu)).
  std::optional<double> shear_modulus = std::nullopt;

  [[nodiscard]] double shear() const { return shear_modulus.value_or(young / (2 * (1 + poisson))); }
};

/// Points at which bending stresses of both planes are largest together.
enum class Outline { kCorners, kRound };

/// Geometry of a cross-section. Axis 2 runs across, axis 3 along the normal; the first is the
/// beam's.
struct SectionShape {
  double area = 0;       // [length^2]
  double moment_2 = 0;   // I_2, of bending about axis 2: integral of squared distances along axis 3
  double moment_3 = 0;   // I_3, of bending about axis 3 [length^4]
  double torsion = 0;    // J, Saint-Venant [length^4]
  double fibre_2 = 0;    // distance of the outermost fibre along axis 2 [length]
  double fibre_3 = 0;    // the same along axis 3
  double shear_arm = 0;  // largest shear strain per twist rate [length]
  Outline outline = Outline::kCorners;
};

/// @throws Error{kInvalidArgument} naming the dimension that is not positive and finite
[[nodiscard]] SectionShape rectangle(double width_along_2, double height_along_3);
[[nodiscard]] SectionShape circle(double radius);
/// @throws Error as circle, also where the inner radius is not below the outer; inner may be 0
[[nodiscard]] SectionShape tube(double outer_radius, double inner_radius);

/// Stiffnesses of a cross-section, with the data that turn forces into stresses and weights.
struct BeamSection {
  double stretching = 0;  // EA [force], > 0
  double torsion = 0;     // GJ [force length^2], > 0 for beams
  double bending_2 = 0;   // EI_2 about axis 2 [force length^2], > 0 for beams
  double bending_3 = 0;   // EI_3 about axis 3
  double mass_per_length = 0;

  // For stresses; 0: not known, stresses come out as 0.
  double young = 0;         // E [force/length^2]
  double shear = 0;         // G
  double fibre_2 = 0;       // as in SectionShape
  double fibre_3 = 0;       //
  double shear_arm = 0;     //
  double yield_stress = 0;  // 0: no utilisation
  Outline outline = Outline::kCorners;
};

/// @throws Error{kInvalidArgument} naming the member of the material that is out of range, or
/// poisson where both it and the shear modulus are given
[[nodiscard]] BeamSection make_section(const SectionShape& shape, const BeamMaterial& material);

}  // namespace limber::beams
