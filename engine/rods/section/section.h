#pragma once

#include <Eigen/Core>
#include <optional>
#include <variant>

#include "engine/rods/section/profile.h"

namespace limber::rods {

// Cross-sections by their dimensions [length], in the plane of axes x and y.

/// width along x, height along y.
struct Rectangle {
  double width = 0;
  double height = 0;
};
/// Full axes: width along x, height along y.
struct Ellipse {
  double width = 0;
  double height = 0;
};
/// Two flanges along x, a web along y between them.
struct ISection {
  double height = 0;  // over all
  double flange_width = 0;
  double flange_thickness = 0;  // along y
  double web_thickness = 0;     // along x
};
/// Two legs that share a corner.
struct LSection {
  double width = 0;   // over all, along x
  double height = 0;  // over all, along y
  double thickness = 0;
};
/// Two bars that cross in their middles.
struct PlusSection {
  double width = 0;
  double height = 0;
  double thickness = 0;
};
/// A circular pipe.
struct Tube {
  double diameter = 0;  // outside
  double wall_thickness = 0;
};

using Section = std::variant<Rectangle, Ellipse, ISection, LSection, PlusSection, Tube, Profile>;

struct SectionProperties {
  double area = 0;
  /// Integrals of the squared distances along the principal axes 1 and 2 [length^4]; the first is
  /// not smaller: bending that moves the rod along axis 1 is the stiffer.
  double second_moment_1 = 0;
  double second_moment_2 = 0;
  Eigen::Vector2d axis_1 = Eigen::Vector2d::UnitX();  // axis 2 is a quarter turn on from it
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  double torsion_constant = 0;  // J of Saint-Venant [length^4]
  /// Largest shear strain in a section that is twisted by one radian per length [length]. Empty
  /// where it has no bound: at sharp re-entrant corners (I, L, plus, most profiles).
  std::optional<double> torsion_shear = {};
};

/// Whether the dimensions make a section: quick, without its torsion.
/// @throws Error{kInvalidArgument} naming the dimension ("section.web_thickness"), its value and
/// its limits; for profiles as Profile::validate; {kLimitExceeded, "section.outer"} for those whose
/// torsion would be too large a problem
void validate(const Section& section);

/// @throws Error as `validate`; for any but Rectangle, Ellipse and Tube as `torsion`
[[nodiscard]] SectionProperties section_properties(const Section& section);

/// Outer outline of a section, counter-clockwise in the axes x and y; 24 corners if it is round.
/// @pre the section is one that section_properties takes
[[nodiscard]] Polygon section_outline(const Section& section);

/// Orientation of a section on the directors of rods. With kD1 or kD2 its stiffer principal axis is
/// that one, so that bending_1 (about d2) is the stiffer or the softer of the two. With kAsGiven
/// its x is d1, its y d2; if its principal axes are oblique, the one nearer to x is d1.
enum class StiffAxis { kD1, kD2, kAsGiven };

/// kD1 or kD2: the equivalent of kAsGiven for a section of these properties.
[[nodiscard]] StiffAxis stiff_axis_of(const SectionProperties& properties, StiffAxis axis);

/// Stiffnesses of a rod of this section.
struct SectionStiffness {
  double stretching = 0;  // E A [force]
  double bending_1 = 0;   // E I [force length^2], curvature about d2
  double bending_2 = 0;   // curvature about d1
  double torsion = 0;     // G J
};
struct RodMaterial {
  double young_modulus = 0;  // [force / length^2], positive
  double poisson_ratio = 0;  // in (-1, 0.5]
  /// @throws Error{kInvalidArgument}
  void validate() const;
};
[[nodiscard]] SectionStiffness section_stiffness(const SectionProperties& properties,
                                                 const RodMaterial& material,
                                                 StiffAxis axis = StiffAxis::kD1);

/// Torsion constant of a rectangle by its series, to rounding.
[[nodiscard]] double rectangle_torsion_constant(double width, double height);
/// SectionProperties::torsion_shear of a rectangle by its series, to rounding: in the middles of
/// the longer sides.
[[nodiscard]] double rectangle_torsion_shear(double width, double height);

}  // namespace limber::rods
