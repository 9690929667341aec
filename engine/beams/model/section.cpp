#include "engine/beams/model/section.h"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "engine/base/error.h"

namespace limber::beams {

namespace {

void require_positive_size(const char* field, double value) {
  if (!(value > 0) || !std::isfinite(value))
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("{} = {}, must be > 0", field, value));
}
void require_no_negative_size(const char* field, double value) {
  if (!(value >= 0) || !std::isfinite(value))
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("{} = {}, must be >= 0", field, value));
}

struct RectangleTorsion {
  double constant;  // J over (long side) (short side)^3
  double shear;     // largest shear strain per twist rate over the short side
};

/// Prandtl's series for a rectangle, ratio = long side / short side >= 1 (Timoshenko and Goodier,
/// Theory of Elasticity, sec. 109).
RectangleTorsion rectangle_torsion(double ratio) {
  RectangleTorsion result{1.0 / 3, 1};
  for (int n = 1; n < 60; n += 2) {
    const double x = 0.5 * n * std::numbers::pi * ratio;
    result.constant -= 64 / (std::pow(std::numbers::pi, 5) * std::pow(n, 5) * ratio) * std::tanh(x);
    result.shear -= 8 / (std::numbers::pi * std::numbers::pi * n * n) / std::cosh(x);
  }
  return result;
}

}  // namespace

SectionShape rectangle(double width_along_2, double height_along_3) {
  require_positive_size("width", width_along_2);
  require_positive_size("height", height_along_3);
  const double b = width_along_2, h = height_along_3;
  const double longer = std::max(b, h), shorter = std::min(b, h);
  const RectangleTorsion torsion = rectangle_torsion(longer / shorter);
  SectionShape shape;
  shape.area = b * h;
  shape.moment_2 = b * h * h * h / 12;
  shape.moment_3 = h * b * b * b / 12;
  shape.torsion = torsion.constant * longer * shorter * shorter * shorter;
  shape.fibre_2 = 0.5 * b;
  shape.fibre_3 = 0.5 * h;
  shape.shear_arm = torsion.shear * shorter;
  return shape;
}

SectionShape circle(double radius) { return tube(radius, 0); }

SectionShape tube(double outer_radius, double inner_radius) {
  require_positive_size("outer_radius", outer_radius);
  require_no_negative_size("inner_radius", inner_radius);
  if (inner_radius >= outer_radius)
    throw Error(
        ErrorCode::kInvalidArgument, "inner_radius",
        fmt::format("inner_radius = {}, must be < outer_radius = {}", inner_radius, outer_radius));
  const double outer_2 = outer_radius * outer_radius, inner_2 = inner_radius * inner_radius;
  SectionShape shape;
  shape.area = std::numbers::pi * (outer_2 - inner_2);
  shape.moment_2 = shape.moment_3 =
      0.25 * std::numbers::pi * (outer_2 * outer_2 - inner_2 * inner_2);
  shape.torsion = 2 * shape.moment_2;
  shape.fibre_2 = shape.fibre_3 = shape.shear_arm = outer_radius;
  shape.outline = Outline::kRound;
  return shape;
}

BeamSection make_section(const SectionShape& shape, const BeamMaterial& material) {
  require_positive_size("young", material.young);
  require_no_negative_size("density", material.density);
  require_no_negative_size("yield_stress", material.yield_stress);
  if (!(material.poisson > -1 && material.poisson <= 0.5))
    throw Error(ErrorCode::kInvalidArgument, "poisson",
                fmt::format("poisson = {}, must be in (-1, 0.5]", material.poisson));
  if (material.shear_modulus) {
    require_positive_size("shear_modulus", *material.shear_modulus);
    if (material.poisson != 0)
      throw Error(ErrorCode::kInvalidArgument, "poisson",
                  fmt::format("poisson = {} beside shear_modulus = {}: give one of them",
                              material.poisson, *material.shear_modulus));
  }
  BeamSection section;
  section.stretching = material.young * shape.area;
  section.torsion = material.shear() * shape.torsion;
  section.bending_2 = material.young * shape.moment_2;
  section.bending_3 = material.young * shape.moment_3;
  section.mass_per_length = material.density * shape.area;
  section.young = material.young;
  section.shear = material.shear();
  section.fibre_2 = shape.fibre_2;
  section.fibre_3 = shape.fibre_3;
  section.shear_arm = shape.shear_arm;
  section.yield_stress = material.yield_stress;
  section.outline = shape.outline;
  return section;
}

}  // namespace limber::beams
