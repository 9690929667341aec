#include "engine/rods/design/kept_factors.h"

#include <gtest/gtest.h>

#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods::detail {
namespace {

std::unique_ptr<HessianFactor> some(const LinkageModel& model) {
  return std::make_unique<HessianFactor>(model.chains());
}

TEST(KeptFactors, AreGivenForTheirOwnPointOnlyAndOnce) {
  const LinkageModel model = rods::testing::curved_model();
  const LinkageState state(model);
  const DesignPoint point{model.segment_lengths(), state, state};
  KeptFactors kept;
  EXPECT_EQ(kept.take(model, point).flat, nullptr);
  kept.keep(point, {some(model), some(model)});
  const auto other = [&](const auto& change) {
    DesignPoint changed = point;
    change(changed);
    return kept.take(model, changed).flat != nullptr;
  };
  Eigen::VectorXd step = Eigen::VectorXd::Zero(model.variables().size());
  step[0] = 1e-12;
  EXPECT_FALSE(other([](DesignPoint& p) { p.lengths[2] *= 1 + 1e-15; }));
  EXPECT_FALSE(other([&](DesignPoint& p) { p.flat = state.moved(model, step); }));
  EXPECT_FALSE(other([&](DesignPoint& p) { p.deployed = state.moved(model, step); }));
  EXPECT_FALSE(other([&](DesignPoint& p) { p.sections.setOnes(p.lengths.size()); }));
  const KeptFactors::Pair taken = kept.take(model, point);
  EXPECT_NE(taken.flat, nullptr);
  EXPECT_NE(taken.deployed, nullptr);
  EXPECT_EQ(kept.take(model, point).flat, nullptr);
}

TEST(KeptFactors, FormerOnesAreMemoryForTheNext) {
  const LinkageModel model = rods::testing::curved_model();
  const LinkageState state(model);
  const DesignPoint point{model.segment_lengths(), state, state};
  KeptFactors kept;
  EXPECT_EQ(kept.spare(), nullptr);
  kept.keep(point, {some(model), nullptr});
  kept.keep(point, {some(model), some(model)});
  EXPECT_NE(kept.spare(), nullptr);
  EXPECT_EQ(kept.spare(), nullptr);
  kept.give_back(nullptr);
  EXPECT_EQ(kept.spare(), nullptr);
}

}  // namespace
}  // namespace limber::rods::detail
