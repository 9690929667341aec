#include "engine/beams/model/section.h"

#include <fmt/core.h>

#include <cmath>

#include "engine/base/error.h"

namespace limber::beams {

namespace {

constexpr double kPi = 3.14159265358979323846;

void require_positive(const char* field, double value) {
  if (!(value > 0) || !std::isfinite(value))
    throw Error(ErrorCode::kInvalidArgument, field,
                fmt::format("{} = {}, must be > 0", field, value));
}
void require_not_negative(const char* field, double value) {
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
    const double x = 0.5 * n * kPi * ratio;
    result.constant -= 64 / (std::pow(kPi, 5) * std::pow(n, 5) * ratio) * std::tanh(x);
    result.shear -= 8 / (kPi * kPi * n * n) / std::cosh(x);
  }
  return result;
}

}  // namespace

SectionShape rectangle(double width_along_2, double height_along_3) {
  require_positive("width", width_along_2);
  require_positive("height", height_along_3);
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
  require_positive("outer_radius", outer_radius);
  require_not_negative("inner_radius", inner_radius);
  if (inner_radius >= outer_radius)
    throw Error(
        ErrorCode::kInvalidArgument, "inner_radius",
        fmt::format("inner_radius = {}, must be < outer_radius = {}", inner_radius, outer_radius));
  const double outer_2 = outer_radius * outer_radius, inner_2 = inner_radius * inner_radius;
  SectionShape shape;
  shape.area = kPi * (outer_2 - inner_2);
  shape.moment_2 = shape.moment_3 = 0.25 * kPi * (outer_2 * outer_2 - inner_2 * inner_2);
  shape.torsion = 2 * shape.moment_2;
  shape.fibre_2 = shape.fibre_3 = shape.shear_arm = outer_radius;
  return shape;
}

BeamSection make_section(const SectionShape& shape, const BeamMaterial& material) {
  require_positive("young", material.young);
  require_not_negative("density", material.density);
  require_not_negative("yield_stress", material.yield_stress);
  if (!(material.poisson > -1 && material.poisson <= 0.5))
    throw Error(ErrorCode::kInvalidArgument, "poisson",
                fmt::format("poisson = {}, must be in (-1, 0.5]", material.poisson));
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
  return section;
}

}  // namespace limber::beams
