// Bodies whose parts differ: most of what bends is in few tets, which a model must find.
#include <gtest/gtest.h>

#include "engine/reduced/reduced_model.h"
#include "tests/engine/reduced/sample_bodies.h"

namespace limber::reduced {
namespace {

/// A bar of 2,304 tets with default options.
ReducedModel build_with_soft_part(bool (*is_soft)(int i, int j, int k)) {
  constexpr int kLength = 24, kSide = 4;
  bodies::ElasticBody body = testing::block(kLength, kSide, kSide, 0.1, true);
  bodies::Material soft = body.mesh.materials[0];
  soft.youngs_modulus /= 33;
  body.mesh.materials.push_back(soft);
  for (int cell = 0; cell < kLength * kSide * kSide; ++cell) {
    const int i = cell / (kSide * kSide), j = cell / kSide % kSide, k = cell % kSide;
    for (int t = 0; t < 6; ++t)
      body.mesh.tet_material[static_cast<std::size_t>(6 * cell + t)] = is_soft(i, j, k) ? 1 : 0;
  }
  return build_model(body, {});
}

void expect_within_tolerance(bool (*is_soft)(int i, int j, int k)) {
  const ReducedModel model = build_with_soft_part(is_soft);
  EXPECT_TRUE(model.report.met_tolerance) << model.report.message;
  EXPECT_LE(model.report.error_mean, ModelOptions{}.tolerance);
}

TEST(UnevenBodies, WithASoftEdgeMeetTheirTolerance) {
  expect_within_tolerance([](int, int j, int k) { return j == 0 && k == 0; });
}

TEST(UnevenBodies, WithASoftHingeMeetTheirTolerance) {
  expect_within_tolerance([](int i, int, int) { return i == 8 || i == 9; });
}

TEST(UnevenBodies, WithASoftBumpMeetTheirTolerance) {
  expect_within_tolerance([](int i, int j, int) { return j == 3 && i > 12 && i < 15; });
}

}  // namespace
}  // namespace limber::reduced
