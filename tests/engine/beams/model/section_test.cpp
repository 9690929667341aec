#include "engine/beams/model/section.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <string>

#include "engine/base/error.h"

namespace limber::beams {
namespace {

TEST(BeamSection, RectanglesAsTabulated) {
  // J = beta b t^3, largest shear T / (alpha b t^2) (Timoshenko and Goodier, table of sec. 109).
  const SectionShape square = rectangle(2, 2);
  EXPECT_NEAR(square.torsion, 0.1406 * 16, 1e-3);
  EXPECT_NEAR(square.shear_arm, 0.675 * 2, 1e-3);
  const SectionShape strip = rectangle(1, 10);
  EXPECT_NEAR(strip.torsion, 0.312 * 10, 5e-3);
  EXPECT_NEAR(strip.moment_2, 1000.0 / 12, 1e-12);
  EXPECT_NEAR(strip.moment_3, 10.0 / 12, 1e-12);
  EXPECT_EQ(strip.fibre_2, 0.5);
  EXPECT_EQ(strip.fibre_3, 5);
  EXPECT_NEAR(rectangle(10, 1).torsion, strip.torsion, 1e-15);
}

TEST(BeamSection, TubesAndCircles) {
  EXPECT_NEAR(circle(2).torsion, 8 * std::numbers::pi, 1e-12);
  EXPECT_NEAR(tube(2, 1).area, 3 * std::numbers::pi, 1e-12);
  EXPECT_NEAR(tube(2, 1).moment_2, 15 * std::numbers::pi / 4, 1e-12);
}

TEST(BeamSection, StiffnessesOfAMaterial) {
  const BeamSection s = make_section(rectangle(2, 3), {100, 0.25, 7, 5});
  EXPECT_EQ(s.stretching, 600);
  EXPECT_EQ(s.bending_2, 450);
  EXPECT_EQ(s.bending_3, 200);
  EXPECT_EQ(s.shear, 40);
  EXPECT_EQ(s.mass_per_length, 42);
}

TEST(BeamSection, AShearModulusTakesThePlaceOfPoissonsRatio) {
  // Timber: no Poisson's ratio gives a G so small.
  BeamMaterial timber{11e9, 0, 460, 24e6, 0.69e9};
  const SectionShape shape = rectangle(0.05, 0.03);
  const BeamSection s = make_section(shape, timber);
  EXPECT_EQ(s.shear, 0.69e9);
  EXPECT_EQ(s.torsion, 0.69e9 * shape.torsion);
  EXPECT_EQ(s.bending_2, 11e9 * shape.moment_2);
  timber.poisson = 0.3;
  const auto field = [&] {
    try {
      (void)make_section(shape, timber);
    } catch (const Error& error) {
      return error.field();
    }
    return std::string("none");
  };
  EXPECT_EQ(field(), "poisson") << "one of them";
  timber.poisson = 0;
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity()}) {
    timber.shear_modulus = bad;
    EXPECT_EQ(field(), "shear_modulus") << bad;
  }
}

TEST(BeamSection, RefusesWhatIsNotASection) {
  EXPECT_THROW((void)rectangle(0, 1), Error);
  EXPECT_THROW((void)circle(-1), Error);
  EXPECT_THROW((void)tube(1, 1), Error);
  EXPECT_THROW((void)make_section(circle(1), {0, 0.3, 0, 0}), Error);
  EXPECT_THROW((void)make_section(circle(1), {1, 0.6, 0, 0}), Error);
}

}  // namespace
}  // namespace limber::beams
