#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "engine/session/beams/session.h"
#include "tests/engine/session/beams/scenes.h"
#include "tests/engine/session/contract/kind_base.h"

namespace limber::session::contract {

/// A cantilever under a load, whose clamp is turned.
struct BeamKind : KindBase<BeamSession, BeamResult, BeamEdit> {
  static constexpr const char* kName = "Beams";
  static constexpr std::size_t kMaxTasks = 1;
  static constexpr bool kReportsProgress = false;
  /// A session keeps the reason why its executor refused a task, but reports it to no listener.
  static constexpr bool kHasStateMessage = false;
  /// The structure is built by the constructor, which throws where it cannot be.
  static constexpr bool kBuildCanFail = false;
  static constexpr bool kCancelFailsBuild = false;

  static std::unique_ptr<Session> open(const Executor& executor,
                                       const std::shared_ptr<Recorder>& recorder) {
    return std::make_unique<Session>("contract", test::cantilever(kElements, 1), BeamLimits(),
                                     executor, recorder);
  }
  static constexpr bool kSolveCanFail = true;
  /// Its solve fails after failing_edits().
  static std::unique_ptr<Session> open_fragile(const Executor& executor,
                                               const std::shared_ptr<Recorder>& recorder) {
    return open(executor, recorder);
  }

  /// A small change of one variable of this client's, which an edit with another number replaces.
  static Edits number(int i, int client = 0) {
    if (client == 0) return {MoveNode{test::turned(0, {0, kTurnStep * i, 0})}};
    return {SetNodeLoad{test::force_on(kElements, 0, 0, -1 + kForceStep * i)}};
  }
  /// The number of the client's newest edit, 0: none.
  static int number_in(const Session& session, int client) {
    const auto conditions = session.conditions();
    if (client == 1)
      return static_cast<int>(std::lround((conditions->loads.at(0).force.z() + 1) / kForceStep));
    if (conditions->motions.empty()) return 0;
    return static_cast<int>(std::lround(conditions->motions[0].rotation.y() / kTurnStep));
  }
  /// So far from number(i) that its solve publishes an iterate long before it ends.
  static Edits slow_edits() { return {MoveNode{test::turned(0, {0, -9, 0})}}; }
  static Edit invalid_edit() { return SetNodeLoad{test::force_on(100000, 0, 0, 1)}; }
  /// It turns about its support without any resistance. The solver reports that: no edit is known
  /// whose solve throws.
  static Edits failing_edits() {
    beams::BeamSupport hinge = test::held(0);
    hinge.fixed[4] = false;
    return {SetSupport{hinge}, SetNodeLoad{test::force_on(kElements)}};
  }
  static Edits mending_edits() { return {SetSupport{test::held(0)}}; }

  /// The shape and its forces; not the path that led to it.
  static std::vector<double> answer(const Result& result) {
    std::vector<double> answer;
    for (const float x : result.frames->rightCols<1>()) answer.push_back(x);
    if (!result.analysis) return answer;
    const beams::BeamState& state = result.analysis->solution.state;
    const auto& forces = result.analysis->results.reaction_forces;
    answer.insert(answer.end(), state.positions.data(),
                  state.positions.data() + state.positions.size());
    answer.insert(answer.end(), forces.data(), forces.data() + forces.size());
    for (const Eigen::Quaterniond& rotation : state.rotations)
      for (const double x : rotation.coeffs()) answer.push_back(x);
    return answer;
  }
  static void read_everything(const Session& session) {
    (void)session.model();
    (void)session.conditions();
  }

 private:
  static constexpr int kElements = 60;
  static constexpr double kTurnStep = -0.01;   // [rad]
  static constexpr double kForceStep = -0.01;  // [N]
};

}  // namespace limber::session::contract
