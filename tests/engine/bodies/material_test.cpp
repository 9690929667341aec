#include "engine/bodies/material.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "engine/base/error.h"

namespace limber::bodies {
namespace {

std::string refusal(const Material& material, const char* field) {
  try {
    material.validate(field);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.field();
  }
  return "accepted";
}

TEST(Material, LameParameters) {
  const Material material{3, 0.25, 1};  // lambda = mu = E / 2.5 at nu = 1/4
  EXPECT_DOUBLE_EQ(material.lame_lambda(), 1.2);
  EXPECT_DOUBLE_EQ(material.lame_mu(), 1.2);
  EXPECT_DOUBLE_EQ((Material{3, 0, 1}.lame_lambda()), 0);
}

TEST(Material, NamesTheOffendingMember) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal({}, "material"), "accepted");
  EXPECT_EQ(refusal({-1, 0.3, 1}, "material"), "material.youngs_modulus");
  EXPECT_EQ(refusal({infinity, 0.3, 1}, "scene.material"), "scene.material.youngs_modulus");
  EXPECT_EQ(refusal({1, 0.5, 1}, ""), "poissons_ratio");
  EXPECT_EQ(refusal({1, -1, 1}, "m"), "m.poissons_ratio");
  EXPECT_EQ(refusal({1, std::nan(""), 1}, "m"), "m.poissons_ratio");
  EXPECT_EQ(refusal({1, 0.4999, 0}, "m"), "m.density");
  EXPECT_EQ(refusal({1, -0.99, 1}, "m"), "accepted");
}

}  // namespace
}  // namespace limber::bodies
