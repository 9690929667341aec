#include "engine/rods/section/section.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "engine/base/error.h"
#include "engine/rods/section/section_reach.h"
#include "engine/rods/section/torsion.h"

namespace limber::rods {
namespace {

Profile rectangle_profile(double width, double height, double angle = 0) {
  const double x = 0.5 * width, y = 0.5 * height, c = std::cos(angle), s = std::sin(angle);
  Profile result;
  for (const auto& [u, v] : {std::pair{-x, -y}, {x, -y}, {x, y}, {-x, y}})
    result.outline.emplace_back(c * u - s * v + 3, s * u + c * v - 1);
  return result;
}

TEST(Section, OfTheReferenceLinkages) {
  // The rectangle of the measured public code (E 3000, nu .38): EA 6750, EI 5062.5 and 316.40625,
  // GJ 386.3122 from a finite-element warping solve.
  const auto s = section_stiffness(section_properties(Rectangle{3, 0.75}), {3000, 0.38});
  EXPECT_DOUBLE_EQ(s.stretching, 6750);
  EXPECT_DOUBLE_EQ(s.bending_1, 5062.5);
  EXPECT_DOUBLE_EQ(s.bending_2, 316.40625);
  EXPECT_NEAR(s.torsion, 386.3122, 2e-5 * s.torsion);
  const auto soft =
      section_stiffness(section_properties(Rectangle{3, 0.75}), {3000, 0.38}, StiffAxis::kD2);
  EXPECT_EQ(soft.bending_1, s.bending_2);
  EXPECT_EQ(soft.bending_2, s.bending_1);
}

TEST(Section, AsGivenLiesByItsOwnAxes) {
  for (const auto& [width, height] : {std::pair{4.0, 16.0}, {16.0, 4.0}, {5.0, 5.0}}) {
    const Rectangle section{width, height};
    const SectionProperties properties = section_properties(section);
    const auto s = section_stiffness(properties, {12, 0}, StiffAxis::kAsGiven);
    EXPECT_DOUBLE_EQ(s.bending_1, height * width * width * width);    // sideways
    EXPECT_DOUBLE_EQ(s.bending_2, width * height * height * height);  // out of the surface
    const Polygon outline = placed_outline(section, properties, StiffAxis::kAsGiven);
    const SectionReach reach(section, properties, StiffAxis::kAsGiven);
    EXPECT_DOUBLE_EQ(reach.along(Eigen::Vector2d::UnitX()).most, width / 2);
    EXPECT_DOUBLE_EQ(reach.along(Eigen::Vector2d::UnitY()).most, height / 2);
    for (const Eigen::Vector2d& corner : outline) {
      EXPECT_NEAR(std::abs(corner.x()), width / 2, 1e-12);
      EXPECT_NEAR(std::abs(corner.y()), height / 2, 1e-12);
    }
  }
  // Oblique principal axes: the nearer one, and halfway the stiffer.
  EXPECT_EQ(stiff_axis_of(section_properties(LSection{2, 2, 0.2}), StiffAxis::kAsGiven),
            StiffAxis::kD1);
  EXPECT_EQ(stiff_axis_of(section_properties(LSection{1, 3, 0.2}), StiffAxis::kAsGiven),
            StiffAxis::kD2);
  EXPECT_EQ(stiff_axis_of(section_properties(ISection{4, 2, 0.2, 0.2}), StiffAxis::kAsGiven),
            StiffAxis::kD2);
}

TEST(Section, RectanglesFromSquareToStrip) {
  // Tabulated: J = beta b t^3 (Timoshenko and Goodier, table of sec. 109).
  EXPECT_NEAR(rectangle_torsion_constant(1, 1), 0.1406, 5e-5);
  EXPECT_NEAR(rectangle_torsion_constant(1, 2), 0.2287 * 2, 1e-4);
  EXPECT_NEAR(rectangle_torsion_constant(10, 1), 0.3123 * 10, 1e-3);
  EXPECT_NEAR(rectangle_torsion_constant(1e5, 1), 1e5 / 3 * (1 - 0.63e-5), 1e-2);
  const auto p = section_properties(Rectangle{0.5, 2});
  EXPECT_DOUBLE_EQ(p.area, 1);
  EXPECT_DOUBLE_EQ(p.second_moment_1, 4 / 12.0);
  EXPECT_EQ(p.axis_1, Eigen::Vector2d::UnitY());
}

TEST(Torsion, AgreesWithTheSeriesOfRectangles) {
  for (const double ratio : {1.0, 1.7, 4.0, 20.0}) {
    const Torsion t = torsion(rectangle_profile(ratio, 1, 0.7));
    const double expected = rectangle_torsion_constant(ratio, 1);
    EXPECT_NEAR(t.constant / expected, 1, 5e-8) << ratio << " with " << t.unknowns;
    EXPECT_LT(t.relative_error, 1e-7);
  }
}

TEST(Section, ProfilesTooFineForTheirTorsionAreKnownBefore) {
  Profile gear;
  for (int i = 0; i < 300; ++i) {
    const double radius = 1 + 0.3 * std::cos(std::numbers::pi * i / 30),
                 angle = std::numbers::pi * i / 150;
    gear.outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  for (const bool solved : {false, true}) {
    try {
      solved ? (void)torsion(gear) : validate(gear);
      ADD_FAILURE() << solved;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kLimitExceeded);
      EXPECT_EQ(error.field(), "section.outer");
    }
  }
}

TEST(Torsion, ShearOfConvexProfiles) {
  for (const double ratio : {1.0, 1.7, 4.0, 20.0}) {
    const auto shear = torsion(rectangle_profile(ratio, 1, 0.7)).shear;
    ASSERT_TRUE(shear);
    EXPECT_NEAR(*shear, rectangle_torsion_shear(ratio, 1), 1e-3) << ratio;
  }
  // Timoshenko and Goodier, table of sec. 109: k times the shorter side.
  EXPECT_NEAR(rectangle_torsion_shear(1, 1), 0.675, 5e-4);
  EXPECT_NEAR(rectangle_torsion_shear(2, 1), 0.930, 5e-4);
  EXPECT_NEAR(rectangle_torsion_shear(1, 1e4), 1, 1e-12);
  // In the middles of its sides, half its height.
  const Profile triangle{{{0, 0}, {2, 0}, {1, std::sqrt(3.0)}}, {}};
  EXPECT_NEAR(*torsion(triangle).shear, std::sqrt(3.0) / 2, 1e-3);
  Profile round;
  for (int i = 0; i < 48; ++i)
    round.outline.emplace_back(1.5 * std::cos(std::numbers::pi * i / 24),
                               std::sin(std::numbers::pi * i / 24));
  EXPECT_NEAR(*torsion(round).shear, *section_properties(Ellipse{3, 2}).torsion_shear, 0.03);
  EXPECT_NEAR(*section_properties(Ellipse{3, 2}).torsion_shear, 2 * 1.5 * 1.5 / 3.25, 1e-12);
  EXPECT_EQ(section_properties(Tube{2, 0.1}).torsion_shear, 1.0);
  Profile pierced = triangle;
  pierced.holes.push_back({{0.9, 0.5}, {1.1, 0.5}, {1, 0.7}});
  EXPECT_FALSE(torsion(pierced).shear);
  EXPECT_FALSE(section_properties(LSection{2, 1, 0.2}).torsion_shear);
}

TEST(Torsion, AgreesWithTheEquilateralTriangle) {
  const double side = 2;
  const Profile triangle{{{0, 0}, {side, 0}, {side / 2, side * std::sqrt(3.0) / 2}}, {}};
  EXPECT_NEAR(torsion(triangle).constant / (std::sqrt(3.0) * std::pow(side, 4) / 80), 1, 1e-8);
}

TEST(Torsion, AgreesWithPolygonsInCirclesAndPipes) {
  // Regular polygons tend to the circle; hollow ones to the pipe, which has a hole.
  const auto polygon = [](int n, double radius) {
    Polygon result;
    for (int i = 0; i < n; ++i)
      result.emplace_back(radius * std::cos(2 * std::numbers::pi * i / n),
                          radius * std::sin(2 * std::numbers::pi * i / n));
    return result;
  };
  const double disc = std::numbers::pi / 2;
  double previous = 1;
  for (const int n : {6, 12, 24}) {
    const double error = 1 - torsion(Profile{polygon(n, 1), {}}).constant / disc;
    EXPECT_GT(error, 0);
    EXPECT_LT(error, 0.35 * previous);
    previous = error;
  }
  const double pipe = std::numbers::pi / 2 * (1 - std::pow(0.8, 4));
  const double hollow = torsion(Profile{polygon(12, 1), {polygon(12, 0.8)}}).constant;
  EXPECT_NEAR(hollow / pipe, 1, 0.1);
  EXPECT_LT(hollow, pipe);
  EXPECT_NEAR(section_properties(Tube{2, 0.2}).torsion_constant, pipe, 1e-14);
}

TEST(Torsion, OfASquareTube) {
  // A closed wall is some sixty times stiffer than the same wall slit open (Bredt: 4 A^2 t / L for
  // the middle line), which a formula for open sections would miss.
  const Profile closed{{{0, 0}, {1, 0}, {1, 1}, {0, 1}},
                       {{{0.1, 0.1}, {0.9, 0.1}, {0.9, 0.9}, {0.1, 0.9}}}};
  const double j = torsion(closed).constant;
  EXPECT_NEAR(j / std::pow(0.9, 3) / 0.1, 1, 0.06);
  const Profile slit{{{0, 0},
                      {1, 0},
                      {1, 1},
                      {0, 1},
                      {0, 0.55},
                      {0.1, 0.55},
                      {0.1, 0.9},
                      {0.9, 0.9},
                      {0.9, 0.1},
                      {0.1, 0.1},
                      {0.1, 0.45},
                      {0, 0.45}},
                     {}};
  EXPECT_NEAR(torsion(slit).constant / j, 3.5e-3 / 3 / 0.0729, 0.1 * 3.5e-3 / 3 / 0.0729);
}

TEST(Torsion, OfThinOpenSectionsTendsToTheirLengths) {
  // Sum of b t^3 / 3 over the legs, with the ends' and the corner's share of order t^4.
  const double t = 0.02;
  const double l = section_properties(LSection{1, 1, t}).torsion_constant;
  const double legs = (2 - t) * t * t * t / 3;
  EXPECT_NEAR(l / legs, 1, 0.02);
  const double i = section_properties(ISection{1, 1, 0.1, 0.1}).torsion_constant;
  EXPECT_NEAR(i / ((3 - 0.2) * 1e-3 / 3), 1, 0.1);
}

TEST(Section, ShapesByTheirParts) {
  const auto i = section_properties(ISection{10, 6, 1, 0.5});
  EXPECT_NEAR(i.area, 2 * 6 + 8 * 0.5, 1e-12);
  EXPECT_NEAR(i.second_moment_1, (6 * 1000 - 5.5 * 512) / 12.0, 1e-10);
  EXPECT_NEAR(i.second_moment_2, (2 * 216 + 8 * 0.125) / 12.0, 1e-10);
  EXPECT_NEAR(std::abs(i.axis_1.y()), 1, 1e-12);
  const auto plus = section_properties(PlusSection{4, 4, 1});
  EXPECT_NEAR(plus.area, 7, 1e-12);
  EXPECT_NEAR(plus.second_moment_1, (64 + 3) / 12.0, 1e-12);
  EXPECT_NEAR(plus.second_moment_2, plus.second_moment_1, 1e-12);
  const auto l = section_properties(LSection{3, 3, 1});
  EXPECT_NEAR(l.area, 5, 1e-12);
  EXPECT_NEAR(std::abs(l.axis_1.x()), std::sqrt(0.5), 1e-10);  // the diagonal
  EXPECT_NEAR(l.axis_1.x(), -l.axis_1.y(), 1e-10);
  const auto ellipse = section_properties(Ellipse{4, 2});
  EXPECT_NEAR(ellipse.torsion_constant, std::numbers::pi * 8 / 5, 1e-12);
}

TEST(Section, SameShapeAnyPlaceSenseAndUnit) {
  const Profile l{{{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}}, {}};
  const auto expected = section_properties(l);
  Profile other;
  for (const auto& p : l.outline)
    other.outline.emplace_back(1e-3 * (5 - p.y()), 1e-3 * (p.x() - 70));
  std::reverse(other.outline.begin(), other.outline.end());
  const auto got = section_properties(other);
  EXPECT_NEAR(got.area / expected.area, 1e-6, 1e-17);
  EXPECT_NEAR(got.second_moment_2 / expected.second_moment_2, 1e-12, 1e-21);
  EXPECT_NEAR(got.torsion_constant / expected.torsion_constant, 1e-12, 1e-20);
}

TEST(Section, ImpossibleDimensionsAreNamed) {
  const auto field_of = [](const Section& section) {
    try {
      (void)section_properties(section);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      return error.field();
    }
    return std::string("accepted");
  };
  EXPECT_EQ(field_of(Rectangle{1, 0}), "section.height");
  EXPECT_EQ(field_of(Rectangle{-1, 1}), "section.width");
  EXPECT_EQ(field_of(Rectangle{1, std::nan("")}), "section.height");
  EXPECT_EQ(field_of(Rectangle{1e-300, 1e-300}), "section.width");
  EXPECT_EQ(field_of(Rectangle{1, 1e31}), "section.height");
  EXPECT_EQ(field_of(Rectangle{1e-30, 1e-30}), "accepted");
  EXPECT_EQ(field_of(Tube{1, 0.6}), "section.wall_thickness");
  EXPECT_EQ(field_of(Tube{1, 0.5}), "accepted");
  EXPECT_EQ(field_of(ISection{1, 1, 0.5, 0.1}), "section.flange_thickness");
  EXPECT_EQ(field_of(ISection{1, 1, 0.1, 1}), "section.web_thickness");
  EXPECT_EQ(field_of(LSection{1, 2, 1}), "section.thickness");
  EXPECT_EQ(field_of(PlusSection{1, 2, 0}), "section.thickness");
  EXPECT_EQ(field_of(Profile{{{0, 0}, {1, 0}}, {}}), "section.outer");
  EXPECT_EQ(field_of(Profile{{{0, 0}, {1, 1}, {1, 0}, {0, 1}}, {}}), "section.outer");
  EXPECT_EQ(field_of(Profile{{{0, 0}, {1, 0}, {1, 0}, {0, 1}}, {}}), "section.outer[1]");
  EXPECT_EQ(field_of(Profile{{{0, 0}, {1, 0}, {2, 0}}, {}}), "section.outer[0]");
  const Polygon square{{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  EXPECT_EQ(field_of(Profile{square, {{{3, 3}, {5, 3}, {5, 5}}}}), "section.holes[0]");
  EXPECT_EQ(field_of(Profile{square, {{{6, 6}, {7, 6}, {7, 7}}}}), "section.holes[0]");
  EXPECT_THROW((void)section_stiffness({}, {3000, 0.6}), Error);
  EXPECT_THROW((void)section_stiffness({}, {0, 0.3}), Error);
}

}  // namespace
}  // namespace limber::rods
