#include "engine/session/beams/analysis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/base/error.h"
#include "engine/session/beams/files.h"
#include "engine/session/beams/job_mapping.h"

namespace limber::session {
namespace {

using ::testing::HasSubstr;

/// A cantilever of `elements` along x, L = 1, EI = 1, clamped at node 0, with a force down at its
/// tip: P L^2 / EI = 1 bends it by 0.30172 (elastica).
scene::BeamJobFiles cantilever_files(int elements) {
  scene::BeamJobFiles files;
  files.mesh.vertices = Eigen::Matrix3Xd::Zero(3, elements + 1);
  files.mesh.vertices.row(0).setLinSpaced(elements + 1, 0, 1);
  files.mesh.normals = Eigen::Vector3d::UnitZ().replicate(1, elements + 1);
  for (int i = 0; i < elements; ++i) files.mesh.edges.emplace_back(i, i + 1);
  files.job.section_width = files.job.section_height = 0.01;
  files.job.young = 12 / 1e-8;
  files.job.poisson = 0.3;
  files.job.fixed.push_back({0, {true, true, true, true, true, true}});
  files.job.forces.push_back({elements, {0, 0, -1}, {0, 0, 0}});
  return files;
}

TEST(BeamAnalysis, ACantileverBendsAsTheElasticaDoes) {
  const BeamAnalysis found = analyse(model_of(cantilever_files(20)), {});
  ASSERT_TRUE(found.solution.report.converged()) << found.solution.report.message;
  EXPECT_NEAR(found.solution.state.positions(2, 20), -0.30172, 1e-4);
  EXPECT_NEAR(found.results.reaction_forces(2, 0), 1, 1e-6);
}

TEST(BeamAnalysis, JobsHoldAllRotationsOfANodeWhereTheyHoldAny) {
  auto files = cantilever_files(2);
  files.job.fixed[0].directions = {true, false, true, false, true, false};
  const auto model = model_of(files);
  EXPECT_EQ(model.supports.at(0).fixed, (std::array<bool, 6>{true, false, true, true, true, true}));
  EXPECT_TRUE(model.temporary_loads.empty());
  files.job.initial_force.z() = 1;
  EXPECT_EQ(model_of(files).temporary_loads.size(), 3U);
}

/// As public jobs mean it: "fixed vertices" and "forced displacements" name the same vertex.
TEST(BeamAnalysis, AVertexOfAJobThatIsFixedAndDisplacedIsDisplaced) {
  auto files = cantilever_files(4);
  files.job.forces.clear();
  files.job.displacements.push_back({0, {0.25, 0, 0.5}});
  const BeamAnalysis found = analyse(model_of(files), {});
  ASSERT_TRUE(found.solution.report.converged()) << found.solution.report.message;
  const Eigen::Matrix3Xd moved = found.solution.state.positions - files.mesh.vertices;
  for (const auto& by : moved.colwise())
    EXPECT_LT((by - Eigen::Vector3d(0.25, 0, 0.5)).norm(), 1e-9);
}

TEST(BeamAnalysis, ShapesAlongThePathAreFewAndInOrder) {
  beams::BeamSolveOptions options;
  options.method = beams::BeamMethod::kRelaxation;
  const BeamAnalysis found = analyse(model_of(cantilever_files(8)), options, 10);
  ASSERT_GE(found.shapes.size(), 2U);
  EXPECT_LE(found.shapes.size(), 10U);
  EXPECT_LT(found.shapes.back()(2, 8), -0.2F) << "the last one is near the end";
  EXPECT_GT(found.shapes.front()(2, 8), -0.2F) << "the first is not";
  EXPECT_TRUE(analyse(model_of(cantilever_files(8)), options).shapes.empty());
}

TEST(BeamAnalysis, CancellingIsAnError) {
  JobContext job;
  job.cancellation.request();
  try {
    (void)analyse(model_of(cantilever_files(8)), {}, 0, job);
    FAIL() << "went through";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

TEST(BeamFiles, TablesHaveARowForEach) {
  const BeamAnalysis found = analyse(model_of(cantilever_files(4)), {});
  const std::string nodes = beam_nodes_csv(found), elements = beam_elements_csv(found);
  EXPECT_EQ(std::count(nodes.begin(), nodes.end(), '\n'), 6);
  EXPECT_EQ(std::count(elements.begin(), elements.end(), '\n'), 5);
  EXPECT_THAT(nodes, HasSubstr("node,x,y,z,rotation_x"));
  EXPECT_THAT(elements, HasSubstr("\n3,3,4,"));
}

TEST(BeamFiles, JsonSaysHowItEndedAndInWhichUnits) {
  const std::string json = beam_json(analyse(model_of(cantilever_files(4)), {}), 3);
  EXPECT_THAT(json, HasSubstr("\"status\": \"converged\""));
  EXPECT_THAT(json, HasSubstr("\"axial_force\": \"N\""));
}

/// Without what separates and indents.
std::string bare(std::string json) {
  json.erase(std::remove_if(json.begin(), json.end(), [](char c) { return c == ' ' || c == '\n'; }),
             json.end());
  return json;
}

TEST(BeamFiles, JsonHasSnapsNeutralDirectionsAndUnjudgedElements) {
  BeamAnalysis found = analyse(model_of(cantilever_files(4)), {});
  beams::BeamReport& report = found.solution.report;
  const std::string none = bare(beam_json(found, 0));
  EXPECT_THAT(none, HasSubstr("\"snaps\":[],\"neutral_directions\":[],\"unjudged_elements\":[]"));
  report.snaps = {{0.25, 1.5, 3}, {0.75, 0.5, 2}};
  report.neutral_directions = {{1, {0, 0.5, -2}, {1, 0, 0}}};
  report.unjudged_elements = {0, 2};
  const std::string json = bare(beam_json(found, 0));
  EXPECT_THAT(json,
              HasSubstr("\"snaps\":[{\"progress\":0.25,\"turn\":1.5,\"node\":3},{\"progress\":"
                        "0.75,\"turn\":0.5,\"node\":2}]"));
  EXPECT_THAT(json, HasSubstr("\"neutral_directions\":[{\"node\":1,\"translation\":[0,0.5,-2],"
                              "\"rotation\":[1,0,0]}]"));
  EXPECT_THAT(json, HasSubstr("\"unjudged_elements\":[0,2]"));
  EXPECT_THAT(json, HasSubstr("\"turn\":\"rad\""));
}

TEST(BeamFiles, UtilisationIsKnownWhereTheYieldStressIs) {
  beams::BeamModel model = model_of(cantilever_files(4));
  for (beams::BeamSection& section : model.sections) section.yield_stress = 0;
  const BeamAnalysis unknown = analyse(model, {});
  EXPECT_THAT(beam_json(unknown, 3), HasSubstr("\"largest_utilisation\": null"));
  EXPECT_THAT(beam_json(unknown, 3), HasSubstr("\"utilisation\": null"));
  EXPECT_THAT(beam_elements_csv(unknown), HasSubstr(",,"));
  for (beams::BeamSection& section : model.sections) section.yield_stress = 1e8;
  const BeamAnalysis known = analyse(model, {});
  EXPECT_THAT(beam_json(known, 3), Not(HasSubstr("null")));
  EXPECT_THAT(beam_elements_csv(known), Not(HasSubstr(",,")));
}

}  // namespace
}  // namespace limber::session
