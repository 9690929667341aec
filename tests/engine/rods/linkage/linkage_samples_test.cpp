// Linkages of limber's own making: they are linkages, and straight where they say so.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "engine/base/error.h"
#include "engine/rods/linkage/linkage_graph.h"
#include "engine/rods/linkage/reduced_variables.h"
#include "engine/scene/samples/linkage_samples.h"

namespace limber::rods {
namespace {

struct KnownSample {
  const char* name;
  int joints, segments;
};
constexpr KnownSample kKnownSamples[] = {
    {"grid", 81, 144}, {"hyperboloid", 84, 144}, {"dome", 81, 144}};

TEST(LinkageSamples, HaveConsistentAngles) {
  ASSERT_EQ(scene::linkage_sample_names().size(), std::size(kKnownSamples));
  for (const KnownSample& known : kKnownSamples) {
    const scene::Linkage linkage = scene::make_linkage_sample(known.name);
    const LinkageGraph graph = build_linkage_graph(linkage.lines);
    EXPECT_EQ(static_cast<int>(graph.joints.size()), known.joints) << known.name;
    EXPECT_EQ(static_cast<int>(graph.segments.size()), known.segments) << known.name;
    EXPECT_EQ(graph.components, 1) << known.name;
    for (const Joint& joint : graph.joints) {
      EXPECT_GT(joint.opening_angle, 0.1) << known.name;
      EXPECT_LT(joint.opening_angle, 1.6) << known.name;
    }
    const ReducedVariables variables(graph, linkage.edges_per_segment);
    EXPECT_GT(variables.size(), 9 * known.joints);
  }
}

TEST(LinkageSamples, RulingsOfTheHyperboloidAreStraight) {
  const scene::Linkage linkage = scene::make_linkage_sample("hyperboloid");
  const LinkageGraph graph = build_linkage_graph(linkage.lines);
  const auto direction = [&](int segment) -> Eigen::Vector3d {
    const auto& ends = graph.segments[static_cast<std::size_t>(segment)].points;
    return (ends[1] - ends[0]).normalized();
  };
  int passing = 0;
  for (const Joint& joint : graph.joints) {
    for (const auto& rod : joint.segments) {
      if (rod[0] < 0 || rod[1] < 0) continue;
      ++passing;
      EXPECT_LT(direction(rod[0]).cross(direction(rod[1])).norm(), 1e-12);
    }
  }
  EXPECT_EQ(passing, 2 * 12 * 5);
}

TEST(LinkageSamples, UnknownNamesAreRefusedWithThoseThereAre) {
  try {
    (void)scene::make_linkage_sample("gird");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
    EXPECT_NE(std::string(error.what()).find("grid, hyperboloid, dome"), std::string::npos);
  }
}

}  // namespace
}  // namespace limber::rods
