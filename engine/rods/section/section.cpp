#include "engine/rods/section/section.h"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/error.h"
#include "engine/rods/section/torsion.h"

namespace limber::rods {

namespace {

void demand_positive(const char* name, double value) {
  if (!(value > 0) || !std::isfinite(value)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("section.{}", name),
                fmt::format("must be positive, got {}", value));
  }
  // Its fourth power is a stiffness, which must not be lost among the smallest or largest numbers.
  constexpr double kLargest = 1e30;
  if (value >= 1 / kLargest && value <= kLargest) return;
  throw Error(
      ErrorCode::kInvalidArgument, fmt::format("section.{}", name),
      fmt::format("must be between {:g} and {:g}, got {:g}", 1 / kLargest, kLargest, value));
}

void demand_below(const char* name, double value, const std::string& limit_name, double limit) {
  demand_positive(name, value);
  if (value < limit) return;
  throw Error(ErrorCode::kInvalidArgument, fmt::format("section.{}", name),
              fmt::format("must be less than {} = {}, got {}", limit_name, limit, value));
}

/// Properties of a shape symmetric about x and y, from its integrals of x^2 and y^2.
SectionProperties symmetric(double area, double xx, double yy, double torsion_constant,
                            double torsion_shear) {
  SectionProperties result;
  result.area = area;
  result.second_moment_1 = std::max(xx, yy);
  result.second_moment_2 = std::min(xx, yy);
  if (yy > xx) result.axis_1 = Eigen::Vector2d::UnitY();
  result.torsion_constant = torsion_constant;
  result.torsion_shear = torsion_shear;
  return result;
}

constexpr int kRoundCorners = 24;  // of the polygon for an ellipse

Polygon outline(const Rectangle& s) {
  const double x = 0.5 * s.width, y = 0.5 * s.height;
  return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

Polygon outline(const Ellipse& s) {
  Polygon result;
  for (int i = 0; i < kRoundCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRoundCorners;
    result.emplace_back(0.5 * s.width * std::cos(angle), 0.5 * s.height * std::sin(angle));
  }
  return result;
}

Polygon outline(const Tube& s) { return outline(Ellipse{s.diameter, s.diameter}); }

Polygon outline(const ISection& s) {
  const double x = 0.5 * s.flange_width, y = 0.5 * s.height, w = 0.5 * s.web_thickness;
  const double z = y - s.flange_thickness;
  return {{-x, -y}, {x, -y}, {x, -z}, {w, -z}, {w, z},   {x, z},
          {x, y},   {-x, y}, {-x, z}, {-w, z}, {-w, -z}, {-x, -z}};
}

Polygon outline(const LSection& s) {
  const double t = s.thickness;
  return {{0, 0}, {s.width, 0}, {s.width, t}, {t, t}, {t, s.height}, {0, s.height}};
}

Polygon outline(const PlusSection& s) {
  const double x = 0.5 * s.width, y = 0.5 * s.height, t = 0.5 * s.thickness;
  return {{-x, -t}, {-t, -t}, {-t, -y}, {t, -y}, {t, -t}, {x, -t},
          {x, t},   {t, t},   {t, y},   {-t, y}, {-t, t}, {-x, t}};
}

Polygon outline(const Profile& profile) { return profile.oriented().outline; }

void check(const Rectangle& s) {
  demand_positive("width", s.width);
  demand_positive("height", s.height);
}

void check(const Ellipse& s) {
  demand_positive("width", s.width);
  demand_positive("height", s.height);
}

void check(const Tube& s) {
  demand_positive("diameter", s.diameter);
  const double outer = 0.5 * s.diameter;
  demand_positive("wall_thickness", s.wall_thickness);
  if (s.wall_thickness > outer) {
    throw Error(
        ErrorCode::kInvalidArgument, "section.wall_thickness",
        fmt::format("must not be more than diameter / 2 = {}, got {}", outer, s.wall_thickness));
  }
}

void check(const ISection& s) {
  demand_positive("height", s.height);
  demand_positive("flange_width", s.flange_width);
  demand_below("flange_thickness", s.flange_thickness, "height / 2", 0.5 * s.height);
  demand_below("web_thickness", s.web_thickness, "flange_width", s.flange_width);
}

void check(const LSection& s) {
  demand_positive("width", s.width);
  demand_positive("height", s.height);
  demand_below("thickness", s.thickness, "the smaller of width and height",
               std::min(s.width, s.height));
}

void check(const PlusSection& s) {
  demand_positive("width", s.width);
  demand_positive("height", s.height);
  demand_below("thickness", s.thickness, "the smaller of width and height",
               std::min(s.width, s.height));
}

void check(const Profile& profile) {
  profile.validate();
  demand_torsion_size(profile);
}

SectionProperties properties(const Rectangle& s) {
  const double area = s.width * s.height;
  return symmetric(area, area * s.width * s.width / 12, area * s.height * s.height / 12,
                   rectangle_torsion_constant(s.width, s.height),
                   rectangle_torsion_shear(s.width, s.height));
}

SectionProperties properties(const Ellipse& s) {
  const double a = 0.5 * s.width, b = 0.5 * s.height, area = std::numbers::pi * a * b;
  return symmetric(area, area * a * a / 4, area * b * b / 4, area * a * a * b * b / (a * a + b * b),
                   2 * a * b * std::max(a, b) / (a * a + b * b));
}

SectionProperties properties(const Tube& s) {
  const double outer = 0.5 * s.diameter, inner = outer - s.wall_thickness;
  // (outer^2 - inner^2) as a product keeps its digits for thin walls.
  const double area = std::numbers::pi * s.wall_thickness * (outer + inner);
  const double second = 0.25 * area * (outer * outer + inner * inner);
  return symmetric(area, second, second, 2 * second, outer);
}

SectionProperties properties(const Profile& profile) {
  const AreaMoments moments = area_moments(profile);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> principal(moments.second);
  SectionProperties result;
  result.area = moments.area;
  result.second_moment_1 = principal.eigenvalues()[1];
  result.second_moment_2 = principal.eigenvalues()[0];
  const double spread = result.second_moment_1 - result.second_moment_2;
  if (spread > 1e-10 * result.second_moment_1) result.axis_1 = principal.eigenvectors().col(1);
  if (result.axis_1.x() < 0 || (result.axis_1.x() == 0 && result.axis_1.y() < 0))
    result.axis_1 = -result.axis_1;
  result.centroid = moments.centroid;
  const Torsion solved = torsion(profile);
  result.torsion_constant = solved.constant;
  result.torsion_shear = solved.shear;
  return result;
}

template <class Shape>
SectionProperties properties(const Shape& s) {
  return properties(Profile{outline(s), {}});
}

}  // namespace

void validate(const Section& section) {
  std::visit([](const auto& shape) { check(shape); }, section);
}

SectionProperties section_properties(const Section& section) {
  validate(section);
  return std::visit([](const auto& shape) { return properties(shape); }, section);
}

Polygon section_outline(const Section& section) {
  return std::visit([](const auto& shape) { return outline(shape); }, section);
}

void RodMaterial::validate() const {
  if (!(young_modulus > 0) || !std::isfinite(young_modulus)) {
    throw Error(ErrorCode::kInvalidArgument, "material.young_modulus",
                fmt::format("must be positive, got {}", young_modulus));
  }
  if (!(poisson_ratio > -1) || !(poisson_ratio <= 0.5)) {
    throw Error(ErrorCode::kInvalidArgument, "material.poisson_ratio",
                fmt::format("must be more than -1 and at most 0.5, got {}", poisson_ratio));
  }
}

StiffAxis stiff_axis_of(const SectionProperties& properties, StiffAxis axis) {
  constexpr double kRounding = 1e-6;  // principal axes halfway between x and y: the stiffer is d1
  if (axis != StiffAxis::kAsGiven) return axis;
  const Eigen::Vector2d first = properties.axis_1.cwiseAbs();
  return first.x() >= first.y() - kRounding ? StiffAxis::kD1 : StiffAxis::kD2;
}

SectionStiffness section_stiffness(const SectionProperties& properties, const RodMaterial& material,
                                   StiffAxis axis) {
  material.validate();
  const double shear = 0.5 * material.young_modulus / (1 + material.poisson_ratio);
  SectionStiffness result{
      material.young_modulus * properties.area, material.young_modulus * properties.second_moment_1,
      material.young_modulus * properties.second_moment_2, shear * properties.torsion_constant};
  if (stiff_axis_of(properties, axis) == StiffAxis::kD2)
    std::swap(result.bending_1, result.bending_2);
  return result;
}

double rectangle_torsion_constant(double width, double height) {
  const double b = std::max(width, height), t = std::min(width, height);
  double sum = 0;
  // (n pi b / 2t) > 20 makes tanh one to rounding; the rest of sum 1/n^5 is known.
  constexpr double kOddFifths = 1.00452376279513961613;  // 31/32 zeta(5)
  double ones = 0;
  for (int n = 1; n * std::numbers::pi * b / (2 * t) < 20; n += 2) {
    const double fifth = std::pow(n, -5);
    sum += fifth * std::tanh(n * std::numbers::pi * b / (2 * t));
    ones += fifth;
  }
  sum += kOddFifths - ones;
  return b * t * t * t / 3 * (1 - 192 * t / (std::pow(std::numbers::pi, 5) * b) * sum);
}

double rectangle_torsion_shear(double width, double height) {
  const double b = std::max(width, height), t = std::min(width, height);
  // (Timoshenko and Goodier, Theory of Elasticity, sec. 109); terms fall below rounding by n = 25
  // in squares, earlier in all else.
  double sum = 0;
  for (int n = 1; n * std::numbers::pi * b / (2 * t) < 40; n += 2)
    sum += 1 / (n * n * std::cosh(n * std::numbers::pi * b / (2 * t)));
  return t * (1 - 8 / (std::numbers::pi * std::numbers::pi) * sum);
}

}  // namespace limber::rods
