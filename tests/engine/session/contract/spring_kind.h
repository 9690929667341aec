#pragma once

#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "tests/engine/session/contract/kind_base.h"
#include "tests/engine/session/springs/session.h"

namespace limber::session::contract {

/// A chain in tension between two pins, of which one is moved.
struct SpringKind : KindBase<springs::SpringSession, springs::SpringResult, springs::SpringEdit> {
  static constexpr const char* kName = "Springs";
  static constexpr std::size_t kMaxTasks = 1;
  static constexpr bool kReportsProgress = false;
  static constexpr bool kHasStateMessage = true;
  /// The constructor throws where there is no chain.
  static constexpr bool kBuildCanFail = false;
  static constexpr bool kCancelFailsBuild = false;

  static std::unique_ptr<Session> open(const Executor& executor,
                                       const std::shared_ptr<Recorder>& recorder) {
    springs::Chain chain;
    chain.nodes = springs::Shape::Zero(3, kSprings + 1);
    for (int i = 0; i <= kSprings; ++i) chain.nodes(0, i) = kSpacing * i;
    chain.springs.assign(kSprings, {10, 1});
    chain.conditions.pins = {{0, {0, 0, 0}}, {kSprings, end(0)}};
    return std::make_unique<Session>("contract", chain, executor, recorder);
  }
  static constexpr bool kSolveCanFail = true;
  /// Its solve fails after failing_edits().
  static std::unique_ptr<Session> open_fragile(const Executor& executor,
                                               const std::shared_ptr<Recorder>& recorder) {
    return open(executor, recorder);
  }

  /// A small change of one variable of this client's, which an edit with another number replaces.
  static Edits number(int i, int client = 0) {
    if (client == 0) return {springs::MovePin{kSprings, end(i)}};
    return {springs::SetLoad{kMiddle, {0, 0, kForceStep * i}}};
  }
  /// The number of the client's newest edit, 0: none.
  static int number_in(const Session& session, int client) {
    const auto conditions = session.conditions();
    if (client == 0)
      return static_cast<int>(std::lround(conditions->pins.at(kSprings).z() / kStep));
    const auto load = conditions->loads.find(kMiddle);
    if (load == conditions->loads.end()) return 0;
    return static_cast<int>(std::lround(load->second.z() / kForceStep));
  }
  /// So far from number(i) that its solve publishes an iterate long before it ends.
  static Edits slow_edits() { return {springs::MovePin{kSprings, {0, 5000, 0}}}; }
  static Edit invalid_edit() { return springs::ReleasePin{100000}; }
  /// The solve throws: nothing holds the chain against the load.
  static Edits failing_edits() {
    return {springs::ReleasePin{0}, springs::ReleasePin{kSprings},
            springs::SetLoad{kMiddle, {0, 0, -1}}};
  }
  static Edits mending_edits() {
    return {springs::MovePin{0, {0, 0, 0}}, springs::MovePin{kSprings, end(0)}};
  }

  static std::vector<double> answer(const Result& result) {
    std::vector<double> answer(result.shape->data(), result.shape->data() + result.shape->size());
    answer.push_back(result.report.elastic);
    return answer;
  }
  static std::string state_message(const Session& session) { return session.state_message(); }
  static void read_everything(const Session& session) { (void)session.conditions(); }

 private:
  static constexpr int kSprings = 20, kMiddle = 10;
  static constexpr double kSpacing = 1.2;                    // [m]
  static constexpr double kStep = 0.01, kForceStep = -0.01;  // [m], [N]

  static Eigen::Vector3d end(int i) { return {kSpacing * kSprings, 0, kStep * i}; }
};

}  // namespace limber::session::contract
