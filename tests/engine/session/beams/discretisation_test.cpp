// The error of elements: estimated behind every final result, and brought below a tolerance.

#include <gtest/gtest.h>

#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <mutex>

#include "engine/base/error.h"
#include "engine/beams/solver/equilibrium.h"
#include "engine/scene/formats/beam_job.h"
#include "engine/session/beams/job_mapping.h"
#include "engine/session/beams/live_problem.h"
#include "engine/session/beams/session.h"
#include "tests/engine/session/beams/scenes.h"
#include "tests/engine/session/bodies/harness.h"

namespace limber::session {
namespace {

using Shared = std::shared_ptr<const BeamResult>;
using Conditions = std::shared_ptr<const BeamConditions>;

Conditions conditions_as_drawn(const beams::BeamModel& model) {
  return std::make_shared<const BeamConditions>(conditions_of(model));
}

LiveBeams::Outcome settle(LiveBeams& live, const Conditions& conditions) {
  return live.solve(conditions, {}, [](const beams::BeamState&) {});
}

/// @returns the last check
std::shared_ptr<const DiscretisationCheck> refine_to_tolerance(LiveBeams& live) {
  auto check = live.check({});
  while (!check->within_tolerance() && live.refine({})) check = live.check({});
  return check;
}

/// Where the nodes are with thirty-two parts of each element, next to where they are.
double off_by(const beams::BeamModel& model, const Conditions& conditions,
              const beams::BeamState& state) {
  const beams::Subdivision whole = beams::Subdivision::even(model, 1),
                           fine = beams::Subdivision::even(model, 32);
  beams::BeamModel now = with_conditions(model, *conditions);
  now.temporary_loads.clear();
  const beams::BeamSolution limit =
      find_equilibrium_from(beams::BeamStructure(cut_model(now, fine)),
                            carry_state(beams::BeamStructure(now), whole, state, fine));
  EXPECT_TRUE(limit.report.converged()) << limit.report.message;
  return (limit.state.positions.leftCols(state.nodes()) - state.positions)
             .colwise()
             .norm()
             .maxCoeff() /
         structure_size(model);
}

TEST(LiveDiscretisation, AToleranceIsMetAndThoseItAsksFewerOfStayCoarse) {
  beams::BeamModel model = test::cantilever(4, 8);
  model.distributed_loads.push_back({0, {0, 0, -4}});
  for (const double tolerance : {1e-3, 1e-5}) {
    LiveBeams live(model, {}, {.tolerance = tolerance});
    const Conditions drawn = conditions_as_drawn(model);
    ASSERT_TRUE(settle(live, drawn).reached);
    const auto check = refine_to_tolerance(live);
    EXPECT_TRUE(check->within_tolerance()) << check->error.position_error;
    EXPECT_LT(off_by(model, drawn, live.state()), tolerance);
    EXPECT_EQ(live.state().nodes(), 5);
    EXPECT_EQ(live.analysis()->results.forces.size(), 4U);
    EXPECT_EQ(live.analysis()->structure.elements(), 4);
    EXPECT_NEAR(live.analysis()->results.reaction_forces(2, 0), 9, 1e-4);
    EXPECT_LT(check->error.elements, 4 * 64);
  }
}

TEST(LiveDiscretisation, ExplicitElementsWinAndTheToleranceIsOnlyReported) {
  const beams::BeamModel model = test::cantilever(2, 8);
  LiveBeams live(model, {}, {.elements_per_member = 3, .tolerance = 1e-6});
  ASSERT_TRUE(settle(live, conditions_as_drawn(model)).reached);
  const auto check = live.check({});
  EXPECT_EQ(check->error.elements, 6);
  EXPECT_FALSE(check->within_tolerance());
  EXPECT_NE(describe_discretisation(*check).find("elements_per_member"), std::string::npos);
}

TEST(LiveDiscretisation, AnEditThatNeedsFewerElementsGetsFewer) {
  const beams::BeamModel model = test::cantilever(4, 12);
  LiveBeams live(model, {}, {.tolerance = 1e-4});
  ASSERT_TRUE(settle(live, conditions_as_drawn(model)).reached);
  const int elements = refine_to_tolerance(live)->error.elements;
  EXPECT_GT(elements, 4);
  auto light = std::make_shared<BeamConditions>(conditions_of(model));
  light->loads[0].force *= 1e-3;
  ASSERT_TRUE(settle(live, light).reached);
  EXPECT_EQ(live.check({})->error.elements, elements) << "as many as there were";
  auto lighter = std::make_shared<BeamConditions>(*light);
  lighter->loads[0].force *= 0.5;
  ASSERT_TRUE(settle(live, lighter).reached);
  const auto check = live.check({});
  EXPECT_LT(check->error.elements, elements);
  EXPECT_TRUE(check->within_tolerance());
}

TEST(LiveDiscretisation, ConditionsThatWereSolvedComeBackToTheLastDigitAcrossARefinement) {
  const beams::BeamModel model = test::cantilever(4, 2);
  LiveBeams live(model, {}, {.tolerance = 1e-5});
  const Conditions first = conditions_as_drawn(model);
  ASSERT_TRUE(settle(live, first).reached);
  refine_to_tolerance(live);
  const beams::BeamState before = live.state();
  auto heavy = std::make_shared<BeamConditions>(*first);
  heavy->loads[0].force *= 6;
  ASSERT_TRUE(settle(live, heavy).reached);
  refine_to_tolerance(live);
  ASSERT_TRUE(settle(live, first).reached);
  EXPECT_EQ((live.state().positions - before.positions).norm(), 0);
}

/// Two elements, turned at one end about their axis.
beams::BeamModel twisted(double turn) {
  beams::BeamModel model = test::cantilever(2, 0);
  beams::PrescribedMotion motion = test::turned(2, {turn, 0, 0});
  motion.translates = {true, true, true};
  model.motions.push_back(motion);
  return model;
}

TEST(LiveDiscretisation, WhatElementsAreTooLongForIsTriedWithShorterOnes) {
  const beams::BeamModel model = twisted(5);  // 2.5 rad an element, of which 2.1 can be told
  const Conditions drawn = conditions_as_drawn(model);
  LiveBeams coarse(model);
  const LiveBeams::Outcome whole = settle(coarse, drawn);
  EXPECT_FALSE(whole.reached);
  EXPECT_TRUE(whole.report.is_unresolved) << whole.report.message;
  LiveBeams live(model, {}, {.tolerance = 1e-3});
  const LiveBeams::Outcome outcome = settle(live, drawn);
  ASSERT_TRUE(outcome.reached) << outcome.report.message;
  const auto check = refine_to_tolerance(live);
  EXPECT_TRUE(check->within_tolerance()) << check->error.message;
  EXPECT_GE(check->error.elements, 4);
}

TEST(LiveDiscretisation, MessagesNameElementsAndNodesOfTheStructure) {
  const beams::BeamModel model = twisted(10);
  LiveBeams live(model, {}, {.elements_per_member = 2});
  const LiveBeams::Outcome outcome = settle(live, conditions_as_drawn(model));
  EXPECT_FALSE(outcome.reached);
  EXPECT_NE(outcome.report.message.find(", part "), std::string::npos) << outcome.report.message;
  EXPECT_LE(outcome.report.node, 2);
}

TEST(DescribeDiscretisation, IsSilentWhereThereIsNothingToSay) {
  DiscretisationCheck check;
  check.error.is_known = true;
  check.error.position_error = 0.009;
  EXPECT_EQ(describe_discretisation(check), "");
  check.error.position_error = 0.02;
  check.error.worst_node = 7;
  EXPECT_EQ(describe_discretisation(check),
            "Positions are off by about 2 % of the structure's size by its discretisation, most at "
            "node 7: use shorter elements (elements_per_member or tolerance of a scene).");
  check.error.moment_error = 0.3;
  check.error.worst_moment_element = 4;
  check.error.utilisation_error = 0.2;
  check.error.worst_utilisation_element = 5;
  EXPECT_EQ(describe_discretisation(check),
            "Positions are off by about 2 % of the structure's size by its discretisation, most at "
            "node 7; bending moments by 30 % of the structure's largest, most in element 4; "
            "utilisations by 20 % of the structure's largest, most in element 5: use shorter "
            "elements (elements_per_member or tolerance of a scene).");
  check.tolerance = 0.05;
  EXPECT_EQ(describe_discretisation(check),
            "Bending moments are off by about 30 % of the structure's largest by its "
            "discretisation, most in element 4; utilisations by 20 % of the structure's largest, "
            "most in element 5 (tolerance 5 %, of moments and utilisations 5 %): use shorter "
            "elements (elements_per_member of the scene).");
  EXPECT_FALSE(check.within_tolerance());
  check.error.utilisation_error = check.error.moment_error = 0.04;
  EXPECT_EQ(describe_discretisation(check), "");
  EXPECT_TRUE(check.within_tolerance());
  // Moments may always be off by 1 %.
  check.error.position_error = 0;
  check.error.utilisation_error.reset();
  for (const auto& [tolerance, limit] : {std::pair{1e-4, 1e-2}, {5e-3, 1e-2}, {2e-2, 2e-2}}) {
    check.tolerance = tolerance;
    check.error.moment_error = 0.99 * limit;
    EXPECT_TRUE(check.within_tolerance()) << tolerance;
    check.error.moment_error = 1.01 * limit;
    EXPECT_FALSE(check.within_tolerance()) << tolerance;
  }
  check.error.is_known = false;
  check.error.message = "halves of 9 elements exceed the limit of 10";
  EXPECT_EQ(
      describe_discretisation(check),
      "The discretisation error could not be estimated: halves of 9 elements exceed the limit "
      "of 10. Use shorter elements: elements_per_member or tolerance of a scene.");
  // Neither cuts a cable.
  check.error.compared_elements = 18;
  check.error.message = "element 2 is a cable that sags: draw it with more elements";
  EXPECT_EQ(describe_discretisation(check),
            "The discretisation error could not be estimated: element 2 is a cable that sags: draw "
            "it with more elements.");
}

/// Keeps results; waits for one.
class Results final : public BeamListener {
 public:
  void on_state(State, const std::string&) override {}
  void on_result(const Shared& result) override {
    const std::lock_guard lock(mutex_);
    results_.push_back(result);
    changed_.notify_all();
  }
  template <class IsIt>
  Shared wait(const IsIt& is_it) {
    std::unique_lock lock(mutex_);
    Shared found;
    changed_.wait_for(lock, std::chrono::seconds(60), [&] {
      for (const Shared& result : results_) {
        if (is_it(*result)) found = result;
      }
      return found != nullptr;
    });
    return found;
  }
  Shared wait_checked(Revision revision) {
    return wait([&](const BeamResult& result) {
      return result.is_final && result.revision >= revision && result.discretisation != nullptr;
    });
  }
  [[nodiscard]] std::vector<Shared> all() const {
    const std::lock_guard lock(mutex_);
    return results_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Shared> results_;
};

TEST(BeamSessionDiscretisation, FinalResultsAreAmendedByTheirError) {
  const auto results = std::make_shared<Results>();
  test::Pool pool{1};
  BeamSession session("x", test::cantilever(4, 10), {}, pool.executor(), results);
  const Shared amended = results->wait_checked(0);
  ASSERT_TRUE(amended);
  EXPECT_EQ(amended->check, Check::kDone);
  EXPECT_NEAR(amended->discretisation->error.position_error,
              off_by(session.model(), session.conditions(), amended->analysis->solution.state),
              1e-3);
  EXPECT_EQ(amended->discretisation->error.elements, 4);
  const Shared before = results->wait(
      [](const BeamResult& result) { return result.is_final && result.check == Check::kPending; });
  ASSERT_TRUE(before);
  EXPECT_EQ(before->frames, amended->frames);
  EXPECT_EQ(before->analysis, amended->analysis);
  EXPECT_EQ(before->sequence + 1, amended->sequence);
  EXPECT_EQ(before->since_edit_ms, amended->since_edit_ms);
  EXPECT_FALSE(before->discretisation);
}

/// A shape of no size is left for the structure as drawn: the check does not take that back.
TEST(BeamSessionDiscretisation, WhatTheSolveSaysStaysInTheMessageOfTheCheckedResult) {
  const auto results = std::make_shared<Results>();
  test::Pool pool{1};
  const beams::BeamModel model = test::cantilever(4, 1);
  beams::BeamState shape = beams::BeamStructure(model).rest_state();
  shape.positions.setZero();
  BeamSession session("x", model, {}, pool.executor(), results, shape);
  const Shared amended = results->wait_checked(0);
  ASSERT_TRUE(amended);
  EXPECT_NE(amended->report.message.find("its given shape led nowhere"), std::string::npos)
      << amended->report.message;
}

TEST(BeamSessionDiscretisation, ATolerancesFinalResultIsTheOneThatMeetsIt) {
  const auto results = std::make_shared<Results>();
  test::Pool pool{1};
  BeamSession session("x", test::cantilever(3, 10), {}, pool.executor(), results, {},
                      {.tolerance = 1e-5});
  const Shared final = results->wait([](const BeamResult& result) { return result.is_final; });
  ASSERT_TRUE(final && final->discretisation);
  EXPECT_EQ(final->check, Check::kNone) << "no amendment follows";
  EXPECT_TRUE(final->discretisation->within_tolerance());
  EXPECT_LT(off_by(session.model(), session.conditions(), final->analysis->solution.state), 1e-5);
  EXPECT_EQ(final->frames->rows(), 7 * 4);
  EXPECT_EQ(final->report.message.find("off by"), std::string::npos);
}

TEST(BeamSessionDiscretisation, AnEditInterruptsTheEstimateAndIsEstimatedItself) {
  const auto results = std::make_shared<Results>();
  test::Pool pool{1};
  BeamSession session("x", test::cantilever(300, 1), {}, pool.executor(), results);
  for (int i = 1; i <= 6; ++i) {
    const Revision revision =
        session.edit({SetNodeLoad{test::force_on(300, 0, 0, -1 - 0.01 * i)}}).revision;
    ASSERT_TRUE(results->wait(
        [&](const BeamResult& result) { return result.is_final && result.revision >= revision; }));
  }
  const Shared amended = results->wait_checked(6);
  ASSERT_TRUE(amended);
  std::uint64_t sequence = 0;
  Revision newest = 0;
  for (const Shared& result : results->all()) {
    EXPECT_EQ(result->sequence, ++sequence);
    EXPECT_GE(result->revision, newest) << "no amendment of what an edit made out of date";
    newest = result->revision;
  }
}

TEST(BeamSessionDiscretisation, CancellingEndsTheEstimateAlone) {
  const auto results = std::make_shared<Results>();
  test::Pool pool{1};
  BeamSession session("x", test::cantilever(300, 1), {}, pool.executor(), results);
  const Shared final = results->wait([](const BeamResult& result) { return result.is_final; });
  ASSERT_TRUE(final);
  session.cancel();
  const Shared amended = results->wait(
      [](const BeamResult& result) { return result.is_final && result.check == Check::kDone; });
  ASSERT_TRUE(amended) << "cancelled or not, waits for the check end";
  EXPECT_TRUE(amended->report.converged());
}

/// The public structures whose single elements bow between their joints.
TEST(PublicStructures, ToleranceRefinesRoofUntilItsPositionsHold) {
  const char* const root = std::getenv("LIMBER_SHARED");
  const std::filesystem::path shared = root != nullptr ? root : LIMBER_SOURCE_DIR "/../shared";
  const auto folder = shared / "data" / "beams" / "roof";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  const beams::BeamModel model = model_of(scene::read_beam_job_folder(folder));
  LiveBeams live(model, {}, {.tolerance = 2e-4});
  const Conditions drawn = conditions_as_drawn(model);
  ASSERT_TRUE(settle(live, drawn).reached);
  const auto first = live.check({});
  EXPECT_GT(first->error.position_error, 1e-3) << "a tenth of a metre of 48";
  const auto check = refine_to_tolerance(live);
  EXPECT_TRUE(check->within_tolerance()) << check->error.position_error;
  // Of moments within 1 %, too.
  EXPECT_LT(check->error.elements, 6 * first->error.elements);
}

}  // namespace
}  // namespace limber::session
