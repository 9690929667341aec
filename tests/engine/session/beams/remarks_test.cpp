#include "engine/session/beams/remarks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "engine/scene/formats/beam_job.h"
#include "engine/session/beams/job_mapping.h"

namespace limber::session {
namespace {

/// Elements of 1 m, one after the other in the plane y = 0, each leaning from the vertical by an
/// angle; twice as stiff in one direction as in the other.
beams::BeamModel leaning_member(const std::vector<double>& degrees) {
  beams::BeamModel model;
  model.sections.push_back({100, 1, 1, 2});
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  model.nodes.push_back({end});
  for (const double degree : degrees) {
    const double angle = degree * std::numbers::pi / 180;
    end += Eigen::Vector3d(std::sin(angle), 0, std::cos(angle));
    model.nodes.push_back({end});
    beams::BeamElement element;
    element.start = static_cast<int>(model.elements.size());
    element.finish = element.start + 1;
    model.elements.push_back(element);
  }
  model.supports.push_back({0, {true, true, true, true, true, true}});
  return model;
}

/// Across the plane, so that a normal in it is 90 degrees off.
beams::BeamModel leaning_sideways(const std::vector<double>& degrees) {
  beams::BeamModel model = leaning_member(degrees);
  for (beams::BeamNode& node : model.nodes)
    node.position = Eigen::Vector3d(0, node.position.x(), node.position.z());
  return model;
}

std::string text_of(const std::vector<scene::Issue>& remarks) {
  return remarks.empty() ? "" : remarks[0].field + ": " + remarks[0].message;
}

TEST(BeamRemarks, SectionsRotatedAlongANearlyVerticalMemberAreNamed) {
  // Vertical elements get x for a normal, the others z: in the plane y = 0 that is the same line.
  EXPECT_TRUE(beam_remarks(leaning_member({0, 0.5, 0})).empty());
  const std::string text = text_of(beam_remarks(leaning_sideways({0.05, 0.5, 0.6, 0.05})));
  EXPECT_EQ(text,
            "elements: elements 0 and 1, 2 and 3 continue each other, but their sections are "
            "rotated against each other by up to 90 degrees about the member: set their normals");
}

TEST(BeamRemarks, ManyRotatedSectionsAreCounted) {
  std::vector<double> degrees;
  for (int i = 0; i < 10; ++i) degrees.push_back(i % 2 == 0 ? 0.05 : 0.5);
  const std::string text = text_of(beam_remarks(leaning_sideways(degrees)));
  EXPECT_NE(text.find("4 and 5 and 4 more pairs continue"), std::string::npos) << text;
}

TEST(BeamRemarks, RotatedSectionsThatDoNotMatterOrWereChosenAreNotNamed) {
  EXPECT_TRUE(beam_remarks(leaning_sideways({0.05, 20})).empty()) << "a corner";
  beams::BeamModel round = leaning_sideways({0.05, 0.5});
  round.sections[0].bending_3 = round.sections[0].bending_2;
  EXPECT_TRUE(beam_remarks(round).empty());
  beams::BeamModel chosen = leaning_sideways({0.05, 0.5});
  for (beams::BeamElement& element : chosen.elements) element.normal = Eigen::Vector3d::UnitX();
  EXPECT_TRUE(beam_remarks(chosen).empty());
  chosen.elements[0].normal.setZero();
  EXPECT_TRUE(beam_remarks(chosen).empty());
}

TEST(BeamRemarks, ThePublicStructuresHaveNone) {
  const char* const root = std::getenv("LIMBER_SHARED");
  const std::filesystem::path shared = root != nullptr ? root : LIMBER_SOURCE_DIR "/../shared";
  if (!std::filesystem::exists(shared / "data" / "beams")) GTEST_SKIP() << "no shared data";
  for (const char* name : {"cantilever", "torus", "pentashell_pinned", "roof"}) {
    const auto folder = shared / "data" / "beams" / name;
    EXPECT_EQ(text_of(beam_remarks(model_of(scene::read_beam_job_folder(folder)))), "") << name;
  }
}

}  // namespace
}  // namespace limber::session
