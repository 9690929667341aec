// Sessions that solve for rest lengths before anything else.

#include "engine/session/linkages/rest_shape.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/session/linkages/live_linkage.h"
#include "engine/session/linkages/session.h"

namespace limber::session {
namespace {

using scene::RestLengthChoice;

scene::Linkage dome(RestLengthChoice choice) {
  scene::Linkage linkage = scene::make_linkage_sample("dome");
  linkage.edges_per_segment = 5;
  linkage.conditions = {};
  linkage.rest_lengths = choice;
  return linkage;
}

double settled_energy(LiveLinkage& live) {
  const auto outcome = live.solve(std::make_shared<scene::LinkageConditions>(), {}, [] {});
  EXPECT_TRUE(outcome.reached) << outcome.report.message;
  return outcome.report.energies.total();
}

TEST(RestShape, LengthsAreThoseOfTheLines) {
  const LiveLinkage live(dome(RestLengthChoice::kAsDrawn));
  EXPECT_EQ(live.model().segment_lengths(), rods::drawn_lengths(live.model().graph()));
}

TEST(RestShape, LeastStressLowersTheEnergyAndEverybodyKnowsTheLengths) {
  LiveLinkage drawn(dome(RestLengthChoice::kAsDrawn));
  LiveLinkage live(dome(RestLengthChoice::kLeastStress));
  const Eigen::VectorXd& lengths = live.model().segment_lengths();
  EXPECT_GT((lengths - drawn.model().segment_lengths()).cwiseAbs().maxCoeff(), 1e-6);
  // Joints are where they are drawn.
  for (std::size_t j = 0; j < drawn.state().joints().size(); ++j)
    EXPECT_EQ(live.state().joints()[j].position, drawn.state().joints()[j].position);
  const LinkageDetail detail = live.statics()->detail(
      live.shape().coordinates(live.model(), live.state()), live.statics()->strains(live.state()));
  for (std::size_t s = 0; s < detail.segments.size(); ++s) {
    EXPECT_NEAR(detail.segments[s].rest_length, lengths[static_cast<Eigen::Index>(s)],
                1e-12 * lengths.maxCoeff());
  }
  const double energy = settled_energy(live);
  EXPECT_LT(energy, settled_energy(drawn));
  // The equilibrium is that of the new lengths, by somebody who only knows the model.
  rods::LinkageState state = live.state();
  const auto again = rods::LinkageEquilibrium(live.model()).solve(state, {});
  EXPECT_TRUE(again.converged());
  EXPECT_NEAR(again.energies.total(), energy, 1e-8 * energy);
}

class ShapeListener : public LinkageListener {
 public:
  void on_progress(const Progress& progress) override {
    stages.push_back(progress.stage);
    if (hook) hook(progress);
  }
  void on_state(State state, const std::string& message) override {
    last = state;
    state_message = message;
  }
  void on_result(const std::shared_ptr<const LinkageResult>& result) override { newest = result; }

  std::function<void(const Progress&)> hook;
  std::vector<std::string> stages;
  State last = State::kBuilding;
  std::string state_message;
  std::shared_ptr<const LinkageResult> newest;
};

/// Builds and solves on request.
struct Manual {
  explicit Manual(const scene::Linkage& linkage)
      : session(
            "manual", linkage, {}, [this](auto task) { tasks.push_back(std::move(task)); },
            listener) {}
  void run() {
    while (!tasks.empty()) {
      const auto task = std::move(tasks.back());
      tasks.pop_back();
      task();
    }
  }
  std::shared_ptr<ShapeListener> listener = std::make_shared<ShapeListener>();
  std::vector<std::function<void()>> tasks;
  LinkageSession session;
};

TEST(RestShape, SessionsTellHowFarTheSolveIs) {
  Manual manual(dome(RestLengthChoice::kLeastStress));
  std::vector<double> fractions;
  manual.listener->hook = [&](const Progress& progress) {
    if (progress.stage == "rest lengths") fractions.push_back(progress.fraction);
  };
  manual.run();
  EXPECT_EQ(manual.session.state(), State::kReady);
  ASSERT_GE(fractions.size(), 2U);
  EXPECT_EQ(fractions.front(), 0);
  EXPECT_EQ(fractions.back(), 1);
  for (std::size_t i = 1; i < fractions.size(); ++i) EXPECT_GE(fractions[i], fractions[i - 1]);
  ASSERT_TRUE(manual.listener->newest);
  EXPECT_TRUE(manual.listener->newest->report.converged());
  EXPECT_EQ(manual.session.linkage().rest_lengths, RestLengthChoice::kLeastStress);

  Manual quick(dome(RestLengthChoice::kAsDrawn));
  quick.run();
  EXPECT_EQ(quick.listener->stages, std::vector<std::string>{"linkage"});
}

TEST(RestShape, CancellingWhileItSolvesEndsTheBuild) {
  Manual manual(dome(RestLengthChoice::kLeastStress));
  manual.listener->hook = [&](const Progress& progress) {
    if (progress.stage == "rest lengths") manual.session.cancel();
  };
  manual.run();
  EXPECT_EQ(manual.session.state(), State::kFailed);
  EXPECT_NE(manual.listener->state_message.find("cancelled"), std::string::npos)
      << manual.listener->state_message;
  EXPECT_FALSE(manual.session.geometry());
  EXPECT_THROW(manual.session.edit({SetMeanAngle{0.5}}), Error);
}

TEST(RestShape, WhereNoneAreFoundTheBuildFailsAndSaysWhy) {
  scene::Linkage linkage = dome(RestLengthChoice::kLeastStress);
  linkage.youngs_modulus = 1e-305;  // energies lose their digits: nothing can be balanced
  Manual manual(linkage);
  manual.run();
  EXPECT_EQ(manual.session.state(), State::kFailed);
  EXPECT_NE(
      manual.listener->state_message.find("rest_lengths: no lengths of least stress were found: "),
      std::string::npos)
      << manual.listener->state_message;
  EXPECT_FALSE(manual.listener->newest);
}

TEST(RestShape, EditsMeanwhileDoNotEndIt) {
  Manual manual(dome(RestLengthChoice::kLeastStress));
  const double wanted = 0.9;
  manual.listener->hook = [&](const Progress& progress) {
    if (progress.stage == "rest lengths") manual.session.edit({SetMeanAngle{wanted}});
  };
  manual.run();
  EXPECT_EQ(manual.session.state(), State::kReady);
  ASSERT_TRUE(manual.listener->newest);
  EXPECT_NEAR(manual.listener->newest->mean_angle, wanted, 1e-6);
}

}  // namespace
}  // namespace limber::session
