#pragma once

#include "tests/engine/session/bodies/harness.h"
#include "tests/engine/session/bodies/scenes.h"

namespace limber::session::test {

inline constexpr int kCells = 6;
inline const int kTip = bar_node(kCells, kCells, 1, 2);
/// Of results: above it a motion shakes.
inline constexpr double kMaxHighFrequencyShare = 1e-5;

/// The bar of the tests with its tip held aside in two frames.
inline scene::Scene bent_bar() {
  scene::Scene scene = bar(kCells, 30);
  scene.constraints = {held(10, kTip, {0, 0.1, 0.05}), held(20, kTip, {0, -0.1, 0.02})};
  return scene;
}

/// A session on threads of its own, with everything it says.
struct Live {
  explicit Live(scene::Scene scene, SessionOptions options = {})
      : session("live", std::move(scene), options, shared_cache(), pool.executor(), recorder) {}
  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>();
  Pool pool{1};
  BodySession session;

  std::shared_ptr<const BodyResult> edit(const std::vector<BodyEdit>& edits) {
    return recorder->wait_final(session.edit(edits).revision);
  }
};

inline Eigen::Vector3d tip_at(const BodySession& session, const BodyResult& result, int frame) {
  return session.positions(result, frame, 1).col(0).segment<3>(3 * kTip);
}

}  // namespace limber::session::test
