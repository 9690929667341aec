// What stuck designs advise.

#include "engine/rods/design/design_text.h"

#include <gtest/gtest.h>

#include <string>

#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods::detail {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(StuckText, OfEachShapeNamesWhatHappenedAndWhatToDo) {
  LineMesh cross;
  cross.vertices.resize(3, 5);
  cross.vertices.transpose() << 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0;
  cross.edges.resize(2, 4);
  cross.edges << 0, 0, 0, 0, 1, 2, 3, 4;
  const LinkageModel model(build_linkage_graph(cross), 3, RodStiffness{1, 1, 1, 1});
  DesignTrial trial{TrialStatus::kFound,
                    {model.segment_lengths(), LinkageState(model), LinkageState(model), {}, {}},
                    0,
                    "60 steps left an imbalance",
                    0,
                    LostShape::kFlat};
  const std::string flat = stuck_text(trial);
  EXPECT_TRUE(contains(flat, "the flat shape is about to buckle (60 steps left")) << flat;
  EXPECT_TRUE(contains(flat, "a larger flat angle or thicker rods")) << flat;
  trial.lost = LostShape::kDeployed;
  const std::string deployed = stuck_text(trial);
  EXPECT_TRUE(contains(deployed, "the deployed shape is about to snap to another one")) << deployed;
  EXPECT_TRUE(contains(deployed, "another mean angle, more joints or thinner rods")) << deployed;
  trial.lost = LostShape::kNone;
  const std::string none = stuck_text(trial);
  EXPECT_TRUE(contains(none, "no step is possible (60 steps left an imbalance)")) << none;
  for (const std::string& text : {flat, deployed, none})
    EXPECT_TRUE(contains(text, "take the best design")) << text;
}

}  // namespace
}  // namespace limber::rods::detail
