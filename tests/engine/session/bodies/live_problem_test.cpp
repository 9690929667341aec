#include "engine/session/bodies/live_problem.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/engine/session/bodies/document_support.h"
#include "tests/engine/session/bodies/session_support.h"

namespace limber::session {
namespace {

using test::bent_bar;
using test::Live;

/// The most sites a problem ever has while one of its constraints moves from group to group.
int most_sites(SiteLimits limits) {
  const scene::Scene scene = bent_bar();
  Live live(scene);
  EXPECT_TRUE(live.recorder->wait_final(0));
  const MappedBody mapped = map_body(scene);
  LiveProblem problem(live.session.model(), nullptr, TargetFrame(scene, mapped),
                      std::make_unique<KeyframeTargets>(scene, live.session.model()),
                      ProblemTerms{scene.frame_count, scene.model.mode_count, {}}, {}, limits);
  Document document(scene);
  problem.start(whole_batch(document));
  int most = 0;
  scene::Constraint group = document.constraint_list().front();
  for (int i = 0; i < 40; ++i) {
    group.nodes = {i, i + 1, i + 2};
    Touched touched;
    document.apply({ReplaceConstraint{group}}, {}, touched);
    problem.apply(batch_of(document, touched));
    most = std::max(most, problem.site_count());
    EXPECT_EQ(problem.solver().constraints().size(), 2u);
    EXPECT_EQ(problem.solver().constraints().front().frame, group.frame);
  }
  return most;
}

TEST(LiveProblem, ForgetsSitesOnceThereAreManyOrTheyNameManyNodes) {
  EXPECT_GT(most_sites({}), 40);
  EXPECT_LE(most_sites({12, 16'000'000}), 13);
  EXPECT_LE(most_sites({20000, 16}), 8);
}

TEST(LiveProblem, GivesUpTheFullMapAndComesBackToItsCorrections) {
  using Level = reduced::LayeredKinematics::Level;
  const scene::Scene scene = bent_bar();
  Live live(scene);
  ASSERT_TRUE(live.recorder->wait_final(0));
  const auto parts = std::make_shared<const BodyParts>(scene);
  const FullBody full(parts, live.session.model());
  LiveProblem problem(live.session.model(), nullptr, TargetFrame(scene, parts->mapped),
                      std::make_unique<KeyframeTargets>(scene, live.session.model()),
                      ProblemTerms{scene.frame_count, scene.model.mode_count, {}}, {});
  const Document document(scene);
  problem.start(whole_batch(document));
  problem.solver().solve();
  problem.provide_full([&] { return full.make_kinematics(); });
  problem.use(Level::kFull);
  const Eigen::MatrixXd before = problem.solver().motion();
  const Cancellation out_of_date;
  problem.heed(out_of_date);
  out_of_date.request();
  EXPECT_EQ(problem.solver().solve().status, spacetime::SolveStatus::kImproved);
  EXPECT_EQ(problem.solver().motion(), before);
  problem.heed({});
  EXPECT_EQ(problem.solver().solve().status, spacetime::SolveStatus::kConverged);
  problem.use(Level::kReduced);
  problem.anchor(spacetime::Known::kAnswer);

  const Eigen::MatrixXd answer = problem.solver().motion();
  const double corrected = problem.solver().solve().total_energy;
  auto corrections = problem.take_corrections();
  problem.solver().warm_start(answer, spacetime::Known::kAnswer);
  const double plain = problem.solver().solve().total_energy;
  EXPECT_GT(std::abs(plain - corrected), 1e-6 * corrected) << "the reduced model's own optimum";
  problem.give_back(std::move(corrections));
  problem.solver().warm_start(answer, spacetime::Known::kAnswer);
  EXPECT_NEAR(problem.solver().solve().total_energy, corrected, 1e-9 * corrected);
}

/// A problem whose fit of all variables an edit has interrupted after its first step.
class InterruptedFit : public ::testing::Test {
 protected:
  void SetUp() override {
    scene::Scene scene = bent_bar();
    scene.material_optimisation.variables = scene::MaterialVariables::kAll;
    const Live live(scene);
    ASSERT_TRUE(live.recorder->wait_final(0));
    const MappedBody mapped = map_body(scene);
    problem_.emplace(
        live.session.model(), nullptr, TargetFrame(scene, mapped),
        std::make_unique<KeyframeTargets>(scene, live.session.model()),
        ProblemTerms{scene.frame_count, scene.model.mode_count, scene.material_optimisation},
        spacetime::SolverOptions());
    document_.emplace(scene);
    problem_->start(whole_batch(*document_));
    problem_->solver().solve();
    spacetime::MaterialSolver fit = first_step();
    first_mixing_ = fit.material().mixing;
    ASSERT_NE(first_mixing_, problem_->material()->mixing);
    problem_->keep_unfinished(fit, 1);
  }

  [[nodiscard]] spacetime::MaterialSolver first_step() const {
    spacetime::MaterialSolver fit = problem_->material_solver();
    fit.solve({}, [](const spacetime::MaterialReport&) { return false; });
    return fit;
  }
  void edit(const BodyEdit& edit) {
    Touched touched;
    document_->apply({edit}, {}, touched);
    problem_->apply(batch_of(*document_, touched));
  }

  std::optional<LiveProblem> problem_;
  std::optional<Document> document_;
  Eigen::MatrixXd first_mixing_;
};

TEST_F(InterruptedFit, ContinuesAfterAMove) {
  edit(MoveConstraint{document_->constraint_list().front().id, {0, 0.11, 0.05}});
  const spacetime::MaterialSolver second = first_step();
  EXPECT_GT((second.material().mixing - first_mixing_).norm(), 0);
  EXPECT_LT((second.material().mixing - first_mixing_).norm(),
            (second.material().mixing - problem_->material()->mixing).norm());
}

TEST_F(InterruptedFit, IsForgottenWithOtherVariables) {
  edit(SetMaterialVariables{scene::MaterialVariables::kDynamics});
  EXPECT_EQ(first_step().material().mixing, problem_->material()->mixing);
}

TEST_F(InterruptedFit, IsForgottenWithAnAnswerOfTheSameMaterial) {
  const Eigen::MatrixXd motion = problem_->solver().motion();
  problem_->set_material(problem_->material());
  problem_->solver().warm_start(motion, spacetime::Known::kAnswer);
  EXPECT_EQ(first_step().material().mixing, first_mixing_);
}

TEST(LiveProblem, KeepsSitesThatAreInUse) { EXPECT_GT(most_sites({20000, 6}), 40); }

}  // namespace
}  // namespace limber::session
