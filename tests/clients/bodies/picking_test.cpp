#include "clients/cpp/bodies/picking.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tests/clients/refusal.h"

namespace limber::client {
namespace {

using ::testing::ElementsAre;

/// A triangle in the plane z = 0, one above it, and one without area.
DrawnSurface three_triangles() {
  return {
      {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 5}, {0, 1, 2, 0, 1, 3, 3, 3, 3}, v1::POINT_SURFACE_CARRIED};
}

std::array<double, 3> weights_of(const PickedPoint& picked) {
  return {picked.point.weights(0), picked.point.weights(1), picked.point.weights(2)};
}

MATCHER_P(AreNear, expected, "") {
  for (std::size_t i = 0; i < 3; ++i)
    if (!(std::abs(arg[i] - expected[i]) < 1e-12)) return false;
  return true;
}

TEST(Picking, FindsPointsInsideOnEdgesAndAtCorners) {
  using Weights = std::array<double, 3>;
  const DrawnSurface surface = three_triangles();
  const PickedPoint inside = nearest_point(surface, {0.25, 0.25, -2});
  EXPECT_EQ(inside.point.triangle(), 0U);
  EXPECT_EQ(inside.point.surface(), v1::POINT_SURFACE_CARRIED);
  EXPECT_THAT(weights_of(inside), AreNear(Weights{0.5, 0.25, 0.25}));
  EXPECT_NEAR(inside.distance, 2, 1e-12);
  EXPECT_THAT(inside.position, AreNear(Vector{0.25, 0.25, 0}));
  EXPECT_THAT(weights_of(nearest_point(surface, {1, 1, 0})), AreNear(Weights{0, 0.5, 0.5}));
  EXPECT_THAT(weights_of(nearest_point(surface, {-1, 3, 0})), AreNear(Weights{0, 0, 1}));
  const PickedPoint tip = nearest_point(surface, {-1, -1, 9});
  EXPECT_THAT(tip.position, AreNear(Vector{0, 0, 5}));
  EXPECT_EQ(tip.point.triangle(), 1U) << "of several the first";
}

TEST(Picking, BoxesHaveTheirFaces) {
  const std::vector<double> points = three_triangles().vertices;
  EXPECT_THAT(points_in_box(points, {0, 0, 0}, {1, 0, 0}), ElementsAre(0U, 1U));
  EXPECT_THAT(points_in_box(points, {-1, -1, 1}, {1, 1, 4.9}), ElementsAre());
}

TEST(Picking, ASurfaceWithoutTrianglesHasNoPoints) {
  EXPECT_EQ(refusal([] {
              (void)nearest_point({}, {0, 0, 0});
            }).code(),
            v1::ERROR_CODE_FAILED_PRECONDITION);
}

}  // namespace
}  // namespace limber::client
