#include "engine/rods/rod/length_weights.h"

#include <gtest/gtest.h>

namespace limber::rods {
namespace {

TEST(LengthWeights, OfUnequalEdgesShareTheSameEnergyWhereFramesAgree) {
  // Equal curvature in both frames: B k^2 / (2 l) with l the mean rest length, in both forms.
  const double mean = 0.5 * (0.3 + 0.5);
  for (const auto form : {BendingForm::kMaterialFrames, BendingForm::kAveragedFrames}) {
    const auto weights = length_weights(0.3, 0.5, form);
    EXPECT_NEAR(weights.before + weights.after + 2 * weights.both, 1 / mean, 1e-15);
    EXPECT_NEAR(weights.twist, 1 / mean, 1e-15);
  }
}

TEST(LengthWeights, Of2008FollowTheEdges) {
  const auto weights = length_weights(0.3, 0.5, BendingForm::kMaterialFrames);
  EXPECT_EQ(weights.both, 0);
  EXPECT_NEAR(weights.before / weights.after, 0.3 / 0.5, 1e-15);
}

}  // namespace
}  // namespace limber::rods
