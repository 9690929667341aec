#include "engine/rods/linkage/edge_numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/rods/linkage/linkage_assembly.h"
#include "tests/engine/rods/linkage/mixed_linkage.h"

namespace limber::rods {
namespace {

using testing::mixed_model;

Eigen::VectorXd changed(Eigen::VectorXd lengths) {
  Random random(3);
  for (double& length : lengths) length *= random.uniform(0.8, 1.2);
  return lengths;
}

TEST(EdgeNumbers, EveryEdgeHasOneAndOnlyTerminalOnesAreShared) {
  const LinkageModel model = mixed_model();
  const EdgeNumbers& numbers = model.edge_numbers();
  std::vector<int> uses(static_cast<std::size_t>(numbers.size()), 0);
  std::set<int> terminals;
  for (int s = 0; s < numbers.segments(); ++s) {
    const Segment& segment = model.graph().segments[static_cast<std::size_t>(s)];
    for (int e = 0; e < 5; ++e) {
      const int number = numbers.edge(s, e);
      ASSERT_TRUE(number >= 0 && number < numbers.size());
      ++uses[static_cast<std::size_t>(number)];
      for (const End end : {kStart, kFinish}) {
        if (e != (end == kStart ? 0 : 4) || segment.joints[end] < 0) continue;
        EXPECT_EQ(number, numbers.terminal(segment.joints[end], segment.rods[end]));
        terminals.insert(number);
      }
    }
  }
  for (int number = 0; number < numbers.size(); ++number) {
    const int count = uses[static_cast<std::size_t>(number)];
    EXPECT_GE(count, 1) << number;
    EXPECT_LE(count, terminals.count(number) > 0 ? 2 : 1) << number;
  }
}

TEST(EdgeNumbers, AModelTakesThemAndGivesThemBack) {
  LinkageModel model = mixed_model();
  const EdgeNumbers& numbers = model.edge_numbers();
  const Eigen::VectorXd edges = changed(model.edge_lengths());
  model.set_edge_lengths(edges);
  EXPECT_EQ(model.edge_lengths(), edges);
  for (int s = 0; s < numbers.segments(); ++s) {
    const auto& joints = model.graph().segments[static_cast<std::size_t>(s)].joints;
    double sum = 0;
    for (int e = 0; e < 5; ++e) {
      const double rest = model.rest_lengths().edge(model.graph(), model.variables(), s, e);
      EXPECT_EQ(rest, edges[numbers.edge(s, e)]);
      const bool shared = (e == 0 && joints[kStart] >= 0) || (e == 4 && joints[kFinish] >= 0);
      sum += shared ? rest / 2 : rest;
    }
    EXPECT_NEAR(model.segment_lengths()[s], sum, 1e-14);
  }
}

TEST(EdgeNumbers, LengthsOfSegmentsMakeTheirEdgesAlikeAgain) {
  LinkageModel model = mixed_model();
  const Eigen::VectorXd drawn = model.segment_lengths(), even = model.edge_lengths();
  model.set_edge_lengths(changed(even));
  model.set_segment_lengths(drawn);
  EXPECT_EQ(model.edge_lengths(), even);
  // Even edges, given one by one, are the same model.
  const LinkageState state = LinkageState(model);
  const double energy = LinkageAssembly(model).energies(state).total();
  model.set_edge_lengths(even);
  EXPECT_EQ(LinkageAssembly(model).energies(state).total(), energy);
  EXPECT_LT((model.segment_lengths() - drawn).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(EdgeNumbers, BadSizesAreNamedAndLeaveTheModelAsItIs) {
  LinkageModel model = mixed_model();
  const Eigen::VectorXd edges = model.edge_lengths(), sections = model.section_scales();
  const auto field = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const Error& error) {
      return error.field();
    }
    return "none";
  };
  for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    Eigen::VectorXd spoilt = edges;
    spoilt[4] = bad;
    EXPECT_EQ(field([&] { model.set_edge_lengths(spoilt); }), "edges[4]");
    spoilt = sections;
    spoilt[2] = bad;
    EXPECT_EQ(field([&] { model.set_section_scales(spoilt); }), "sections[2]");
  }
  EXPECT_EQ(model.edge_lengths(), edges);
  EXPECT_EQ(model.section_scales(), sections);
}

}  // namespace
}  // namespace limber::rods
