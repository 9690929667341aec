#include "engine/rods/linkage/chain_walk.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace limber::rods::detail {
namespace {

/// Writes down what it is asked.
struct Recorder {
  char edge_at(int e) {
    log.push_back(std::string("edge ") + static_cast<char>('a' + e));
    return static_cast<char>('a' + e);
  }
  std::string vertex(int e, char edge, char next) {
    log.push_back("vertex " + std::to_string(e));
    return {edge, next};
  }
  void edge(int e, char edge, char next, const std::string& before, const std::string& after) {
    log.push_back(std::to_string(e) + " " + edge + next + ": " + before + ", " + after);
  }
  std::vector<std::string> log;
};

TEST(ChainWalk, ComputesEachEdgeAndVertexOnceInOrder) {
  Recorder recorder;
  walk_chain(3, recorder);
  const std::vector<std::string> expected{"edge a", "edge b",   "vertex 0",     "0 ab: , ab",
                                          "edge c", "vertex 1", "1 bc: ab, bc", "2 cc: bc, "};
  EXPECT_EQ(recorder.log, expected);
}

TEST(ChainWalk, ASingleEdgeHasNoVertices) {
  Recorder recorder;
  walk_chain(1, recorder);
  EXPECT_EQ(recorder.log, (std::vector<std::string>{"edge a", "0 aa: , "}));
}

TEST(ChainWalk, GradientsOfEdgesAddUpAtTheVertexBetween) {
  // What is not zero before, only the first edge's vertex must be.
  std::vector<double> gradient(11 * kChainLanes, 7);
  std::fill_n(gradient.begin(), 3 * kChainLanes, 0.0);
  const auto lane = [](double value) { return ChainLane(value); };
  add_edge_gradient(gradient.data(), 0, {{lane(1), lane(2), lane(3)}, lane(4)});
  add_edge_gradient(gradient.data(), 1, {{lane(10), lane(20), lane(30)}, lane(40)});
  const double expected[11] = {-1, -2, -3, 4, 1 - 10, 2 - 20, 3 - 30, 40, 10, 20, 30};
  for (int number = 0; number < 11; ++number) {
    for (int k = 0; k < kChainLanes; ++k)
      EXPECT_EQ(gradient[static_cast<std::size_t>(number * kChainLanes + k)], expected[number]);
  }
}

}  // namespace
}  // namespace limber::rods::detail
