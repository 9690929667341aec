// Edits of the public structures: they end within bounded work, one way or the other.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <set>
#include <vector>

#include "engine/base/random.h"
#include "engine/scene/formats/beam_job.h"
#include "engine/session/beams/job_mapping.h"
#include "engine/session/beams/live_beams.h"
#include "tests/support/beam_structures.h"

namespace limber::session {
namespace {

using Conditions = std::shared_ptr<const BeamConditions>;

std::filesystem::path structure_folder(const std::string& name) {
  const char* const root = std::getenv("LIMBER_SHARED");
  const std::filesystem::path shared = root != nullptr ? root : LIMBER_SOURCE_DIR "/../shared";
  return shared / "data" / "beams" / name;
}

LiveBeams::Outcome solve(LiveBeams& live, const Conditions& conditions) {
  return live.solve(conditions, {}, [](const beams::BeamState&) {});
}

/// One of the nodes that motions bring somewhere is brought further, by a share of the extent.
Conditions moved_conditions(const beams::BeamModel& model, double share, Random& random) {
  auto conditions = std::make_shared<BeamConditions>(conditions_of(model));
  const Eigen::Vector3d direction = limber::testing::random_direction(random);
  auto& motion = conditions->motions[random.index(conditions->motions.size())];
  motion.translation += share * limber::testing::extent_of(model) * direction;
  return conditions;
}

/// @returns whether an equilibrium was found
bool edit_ends(LiveBeams& live, const Conditions& conditions, const beams::BeamModel& model) {
  const beams::BeamState before = live.state();
  const LiveBeams::Outcome outcome = solve(live, conditions);
  const beams::BeamReport& report = outcome.report;
  const auto bound = beams::BeamSolveOptions::live(static_cast<int>(model.elements.size()));
  // The path, then what relaxation brought near, each within its own bound.
  EXPECT_LE(report.factorizations, 2 * bound.factorizations) << report.message;
  EXPECT_LE(report.relaxation_steps, 2 * bound.relaxation_steps) << report.message;
  if (outcome.reached) {
    EXPECT_EQ(report.load_factor, 1);
    EXPECT_EQ(report.negative_eigenvalues.value_or(-1), 0);
  } else {
    EXPECT_GE(report.load_factor, 0);
    EXPECT_LT(report.load_factor, 1);
    EXPECT_EQ(report.message.rfind("Stopped at ", 0), 0U) << report.message;
    EXPECT_EQ((live.state().positions - before.positions).norm(), 0) << "the last equilibrium";
  }
  return outcome.reached;
}

class LiveStructure : public ::testing::TestWithParam<const char*> {};

TEST_P(LiveStructure, SmallEditsEndWithAnEquilibriumOrTheShareUpToWhichThereIsOne) {
  const auto folder = structure_folder(GetParam());
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const beams::BeamModel model = model_of(scene::read_beam_job_folder(folder));
  LiveBeams opened(model);
  const auto drawn = std::make_shared<const BeamConditions>(conditions_of(model));
  ASSERT_TRUE(solve(opened, drawn).reached);
  Random random(7);
  int reached = 0;
  for (int i = 0; i < 3; ++i) {
    LiveBeams live(opened);
    reached += edit_ends(live, moved_conditions(model, 0.005, random), model) ? 1 : 0;
    // The next edit begins from the last equilibrium: back where it was is found again.
    EXPECT_TRUE(solve(live, drawn).reached);
  }
  EXPECT_GE(reached, 1);
}

/// The first held nodes that `limber-bench beam_edits` moves; the third move ends balanced, with an
/// element pressed with more than twice its buckling load.
TEST(LiveTorus, AMoveThatEndsWithAnUnresolvedElementHasAShare) {
  const auto folder = structure_folder("torus");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const beams::BeamModel model = model_of(scene::read_beam_job_folder(folder));
  LiveBeams opened(model);
  const auto drawn = std::make_shared<const BeamConditions>(conditions_of(model));
  ASSERT_TRUE(solve(opened, drawn).reached);
  std::set<int> unique;
  for (const beams::BeamSupport& support : drawn->supports) unique.insert(support.node);
  for (const beams::PrescribedMotion& motion : drawn->motions) unique.insert(motion.node);
  const std::vector<int> held(unique.begin(), unique.end());
  Random random(2026);
  for (int i = 0; i < 3; ++i) {
    const double share = random.uniform(0.005, 0.005);
    beams::PrescribedMotion motion;
    motion.node = held[random.index(held.size())];
    motion.translates = {true, true, true};
    motion.translation =
        opened.state().positions.col(motion.node) -
        model.nodes[static_cast<std::size_t>(motion.node)].position +
        share * limber::testing::extent_of(model) * limber::testing::random_direction(random);
    auto conditions = std::make_shared<BeamConditions>(*drawn);
    std::erase_if(conditions->motions, [&](const auto& m) { return m.node == motion.node; });
    for (beams::BeamSupport& support : conditions->supports) {
      if (support.node == motion.node)
        support.fixed[0] = support.fixed[1] = support.fixed[2] = false;
    }
    conditions->motions.push_back(motion);
    LiveBeams live(opened);
    (void)edit_ends(live, conditions, model);
  }
}

INSTANTIATE_TEST_SUITE_P(LiveBeams, LiveStructure, ::testing::Values("roof", "torus"),
                         [](const auto& of) { return std::string(of.param); });

}  // namespace
}  // namespace limber::session
