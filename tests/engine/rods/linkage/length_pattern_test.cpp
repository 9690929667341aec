#include "engine/rods/linkage/length_pattern.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/rods/linkage/linkage_derivatives.h"
#include "tests/engine/rods/linkage/small_linkages.h"

namespace limber::rods {
namespace {

using namespace testing;

TEST(LengthPattern, ColoursDoNotMeetAndNothingIsOutOfReach) {
  const LinkageModel model = grid_model(7, 6, 1.0);
  const LengthPattern pattern = length_pattern(model.graph());
  std::vector<int> counts(pattern.reaches.size(), 0);
  for (const auto& colour : pattern.colours) {
    std::vector<int> joints, lengths;
    for (const int s : colour) {
      ++counts[static_cast<std::size_t>(s)];
      const auto& reach = pattern.reaches[static_cast<std::size_t>(s)];
      joints.insert(joints.end(), reach.joints.begin(), reach.joints.end());
      lengths.insert(lengths.end(), reach.lengths.begin(), reach.lengths.end());
    }
    for (auto* list : {&joints, &lengths}) {
      std::sort(list->begin(), list->end());
      EXPECT_EQ(std::adjacent_find(list->begin(), list->end()), list->end());
    }
  }
  EXPECT_EQ(counts, std::vector<int>(pattern.reaches.size(), 1));
  EXPECT_LT(pattern.colours.size(), pattern.reaches.size() / 2);
  // Column by column, without colours: the same.
  LinkageDerivatives derivatives(model);
  const LinkageState state(model);
  const auto columns = derivatives.by_lengths({state});
  const auto m = static_cast<Eigen::Index>(pattern.reaches.size());
  for (Eigen::Index s = 0; s < m; ++s) {
    const LinkageVector alone = derivatives.second({state}, {{}, Eigen::VectorXd::Unit(m, s)});
    EXPECT_EQ(Eigen::VectorXd(columns.unknowns.col(s)), alone.unknowns) << s;
    EXPECT_EQ(Eigen::VectorXd(columns.lengths.col(s)), alone.lengths) << s;
  }
}

}  // namespace
}  // namespace limber::rods
