#include "engine/rods/design/design_merit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace limber::rods::detail {
namespace {

using Verdict = ViolationWatch::Verdict;

/// Of a violation by step.
template <class Violation>
std::vector<Verdict> verdicts(int steps, const Violation& violation) {
  ViolationWatch watch;
  std::vector<Verdict> seen;
  for (int k = 0; k < steps; ++k) seen.push_back(watch.see(violation(k), k));
  return seen;
}
auto count(const std::vector<Verdict>& seen, Verdict verdict) {
  return std::count(seen.begin(), seen.end(), verdict);
}

TEST(ViolationWatch, GivesUpWhatNothingLessens) {
  const auto seen = verdicts(76, [](int) { return 0.3; });
  EXPECT_EQ(count(seen, Verdict::kRaise), 4);
  EXPECT_EQ(seen.back(), Verdict::kHopeless);
  EXPECT_EQ(count(seen, Verdict::kHopeless), 1);
}

TEST(ViolationWatch, WaitsForWhatLessensSlowly) {
  const auto seen = verdicts(400, [](int k) { return std::pow(0.99, k / 10); });
  EXPECT_EQ(count(seen, Verdict::kHopeless), 0);
}

TEST(ViolationWatch, SeesNothingWhereConstraintsHold) {
  const auto holds = verdicts(400, [](int) { return 0.0; });
  EXPECT_EQ(count(holds, Verdict::kFine), 400);
  // Held in between: what is violated later begins anew.
  const auto seen = verdicts(120, [](int k) { return k == 60 ? 0.0 : 0.3; });
  EXPECT_EQ(count(seen, Verdict::kHopeless), 0);
}

}  // namespace
}  // namespace limber::rods::detail
