#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/session/bodies/problem_mapping.h"
#include "engine/session/bodies/session.h"
#include "tests/engine/session/bodies/harness.h"
#include "tests/engine/session/bodies/scenes.h"
#include "tests/engine/session/contract/kind_base.h"
#include "tests/support/temporary_folder.h"

namespace limber::session::contract {

/// A short bar, whose tip is held aside in two frames.
struct BodyKind : KindBase<BodySession, BodyResult, BodyEdit> {
  static constexpr const char* kName = "Bodies";
  /// The session's and the one that checks final results.
  static constexpr std::size_t kMaxTasks = 2;
  static constexpr bool kReportsProgress = true;
  static constexpr bool kHasStateMessage = true;
  static constexpr bool kBuildCanFail = true;
  /// Cancelled while it builds, it has no model.
  static constexpr bool kCancelFailsBuild = true;

  static std::unique_ptr<BodySession> open(const Executor& executor,
                                           const std::shared_ptr<Recorder>& recorder) {
    return open_with(test::shared_cache(), executor, recorder);
  }
  /// Its build fails once it runs.
  static std::unique_ptr<BodySession> open_failing(const Executor& executor,
                                                   const std::shared_ptr<Recorder>& recorder) {
    auto session = open(executor, recorder);
    session->cancel();
    return session;
  }
  /// No edit is known after which its solve throws: what could make it is refused.
  static constexpr bool kSolveCanFail = false;

  /// A small change of one variable of this client's, which an edit with another number replaces.
  static Edits number(int i, int client = 0) {
    const double y = 0.05 + kStep * i;
    return {client == 0 ? MoveConstraint{1, {0, y, 0.02}} : MoveConstraint{2, {0, -y, 0}}};
  }
  /// The number of the client's newest edit, 0: none.
  static int number_in(const BodySession& session, int client) {
    const auto constraints = session.constraints();
    const double y = std::abs(constraints.at(static_cast<std::size_t>(client)).target.y());
    return static_cast<int>(std::lround((y - 0.05) / kStep));
  }
  /// So far from number(i) that its solve publishes an iterate long before it ends.
  static Edits slow_edits() { return {MoveConstraint{1, {-0.1, 0.3, 0.1}}}; }
  static BodyEdit invalid_edit() { return RemoveConstraint{99}; }

  /// All that a client sees of the motion.
  static std::vector<double> answer(const BodyResult& result) {
    std::vector<double> answer(result.modal.data(), result.modal.data() + result.modal.size());
    const Eigen::MatrixXf& q = result.coordinates;
    answer.insert(answer.end(), q.data(), q.data() + q.size());
    return answer;
  }
  static std::string state_message(const BodySession& session) { return session.state_message(); }
  static void read_everything(const BodySession& session) {
    (void)session.scene();
    (void)session.keyframes();
    (void)session.unedited();
    (void)session.dynamics();
    (void)session.material_variables();
    (void)session.progress();
    (void)session.geometry();
    (void)session.model();
    (void)session.model_message();
    (void)session.build_seconds();
    (void)session.model_from_cache();
    if (const auto newest = session.newest_result()) (void)session.positions(*newest, 0, 1);
  }

 private:
  static constexpr int kCells = 4;
  static constexpr double kStep = 0.001;

  static scene::Scene short_bar() {
    const int tip = test::bar_node(kCells, kCells, 1, 2);
    scene::Scene scene = test::bar(kCells, 24);
    scene.model.mode_count = 6;
    scene.model.basis_size = 12;
    scene.model.cubature_size = 6;
    scene.constraints = {test::held(8, tip, {0, 0.05, 0.02}), test::held(16, tip, {0, -0.05, 0})};
    return scene;
  }
  static std::unique_ptr<BodySession> open_with(std::shared_ptr<ModelCache> cache,
                                                const Executor& executor,
                                                const std::shared_ptr<Recorder>& recorder) {
    return std::make_unique<BodySession>("contract", short_bar(), SessionOptions(),
                                         std::move(cache), executor, recorder);
  }
};

}  // namespace limber::session::contract
