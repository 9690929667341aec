#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/session/linkages/session.h"
#include "tests/engine/session/contract/kind_base.h"
#include "tests/engine/session/linkages/live_linkages.h"

namespace limber::session::contract {

/// A hyperboloid of rods, pinned at one joint and opened by its mean angle.
struct LinkageKind : KindBase<LinkageSession, LinkageResult, LinkageEdit, LinkageListener> {
  static constexpr const char* kName = "Linkages";
  static constexpr std::size_t kMaxTasks = 2;
  static constexpr bool kReportsProgress = true;
  static constexpr bool kHasStateMessage = true;
  static constexpr bool kBuildCanFail = true;
  /// As drawn, it is built at once; cancelled is then the first solve.
  static constexpr bool kCancelFailsBuild = false;

  static std::unique_ptr<Session> open(const Executor& executor,
                                       const std::shared_ptr<Recorder>& recorder) {
    return open_with(pinned_hyperboloid(), executor, recorder);
  }
  /// Its build fails once it runs: energies lose their digits.
  static std::unique_ptr<Session> open_failing(const Executor& executor,
                                               const std::shared_ptr<Recorder>& recorder) {
    scene::Linkage soft = pinned_hyperboloid();
    soft.rest_lengths = scene::RestLengthChoice::kLeastStress;
    soft.youngs_modulus = 1e-305;
    return open_with(soft, executor, recorder);
  }
  static constexpr bool kSolveCanFail = true;
  /// Its solve fails after failing_edits().
  static std::unique_ptr<Session> open_fragile(const Executor& executor,
                                               const std::shared_ptr<Recorder>& recorder) {
    return open(executor, recorder);
  }

  /// A small change of one variable of this client's, which an edit with another number replaces.
  static Edits number(int i, int client = 0) {
    if (client == 0) return {SetMeanAngle{kOpened + kAngleStep * i}};
    return {loaded({0, 0, kForceStep * i})};
  }
  /// The number of the client's newest edit, 0: none.
  static int number_in(const Session& session, int client) {
    const auto conditions = session.conditions();
    if (client == 0)
      return static_cast<int>(
          std::lround((conditions->mean_angle.value_or(kOpened) - kOpened) / kAngleStep));
    if (conditions->loads.empty()) return 0;
    return static_cast<int>(std::lround(conditions->loads[0].force.z() / kForceStep));
  }
  /// So far from number(i) that its solve publishes an iterate long before it ends.
  static Edits slow_edits() { return {SetMeanAngle{kOpened + 60 * testing::kDegree}}; }
  static Edit invalid_edit() { return PinJoint{100000, scene::Held::kMotion}; }
  /// Nothing holds it against the load. The solver reports that: no edit is known whose solve
  /// throws.
  static Edits failing_edits() { return {PinJoint{kPinned, std::nullopt}, loaded({0, 0, -1})}; }
  static Edits mending_edits() { return {loaded({0, 0, 0})}; }

  /// The shape, its strains and energies; not the path that led to it.
  static std::vector<double> answer(const Result& result) {
    std::vector<double> answer = {result.mean_angle, result.report.energies.total(),
                                  result.report.potential()};
    for (const float x : result.frames->rightCols<1>()) answer.push_back(x);
    for (const float strain : result.strains->rightCols<1>()) answer.push_back(strain);
    return answer;
  }
  static std::string state_message(const Session& session) { return session.state_message(); }
  static void read_everything(const Session& session) {
    (void)session.linkage();
    (void)session.linkage_in_shape();
    (void)session.conditions();
    (void)session.newest_design();
    (void)session.geometry();
    (void)session.shape();
    (void)session.statics();
    if (const auto newest = session.newest_result())
      (void)session.surface(newest->frames->rightCols<1>());
  }

 private:
  static constexpr int kPinned = 0, kLoaded = 30;
  static constexpr double kOpened = 20 * testing::kDegree, kAngleStep = 0.1 * testing::kDegree;
  static constexpr double kForceStep = -0.001;  // [N]

  static scene::Linkage pinned_hyperboloid() {
    scene::Linkage linkage = testing::hyperboloid();
    linkage.conditions.mean_angle = kOpened;
    linkage.conditions.pins.push_back({kPinned, scene::Held::kMotion});
    return linkage;
  }
  static std::unique_ptr<Session> open_with(const scene::Linkage& linkage, const Executor& executor,
                                            const std::shared_ptr<Recorder>& recorder) {
    return std::make_unique<Session>("contract", linkage, LinkageLimits(), executor, recorder);
  }
  static SetJointLoad loaded(const Eigen::Vector3d& force) {
    scene::JointLoad load;
    load.joint = kLoaded;
    load.force = force;
    return {load};
  }
};

}  // namespace limber::session::contract
