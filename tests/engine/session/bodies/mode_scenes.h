#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/engine/session/bodies/session_support.h"

// Scenes whose sessions choose their modes.

namespace limber::session::test {

inline const int kCorner = bar_node(kCells, 3, 0, 0), kOpposite = bar_node(kCells, 3, 1, 2);
inline constexpr double kHard = 1e6;

/// The bar of the tests, which does not name its modes.
inline scene::Scene unnamed_bar() {
  scene::Scene scene = bent_bar();
  scene.model.mode_count = scene::ModelRequest::kDefaultModes;
  return scene;
}

inline SessionOptions choosing(ModeChoiceOptions options = {}) {
  SessionOptions session;
  session.mode_choice = options;
  return session;
}

/// The tip is held aside, hard: the default modes are enough.
inline scene::Scene easy_bar() {
  scene::Scene scene = unnamed_bar();
  for (auto& constraint : scene.constraints) constraint.weight = kHard;
  return scene;
}

/// Two nodes of one cross-section, pulled apart in one frame: that takes more modes.
inline std::vector<scene::Constraint> pulled_apart(double share = 1) {
  std::vector<scene::Constraint> pair = {
      held(15, kCorner, share * Eigen::Vector3d(0.02, 0.06, -0.05)),
      held(15, kOpposite, share * Eigen::Vector3d(0.02, -0.05, 0.03))};
  for (auto& constraint : pair) constraint.weight = kHard;
  return pair;
}

inline std::vector<BodyEdit> pull_apart(double share = 1) {
  std::vector<BodyEdit> edits;
  for (const auto& constraint : pulled_apart(share)) edits.emplace_back(AddConstraint{constraint});
  return edits;
}

inline scene::Scene demanding_bar() {
  scene::Scene scene = easy_bar();
  for (const auto& constraint : pulled_apart()) scene.constraints.push_back(constraint);
  return scene;
}

/// The newest result, once nothing more is to be found out about a revision.
inline std::shared_ptr<const BodyResult> settled(const BodySession& session,
                                                 Revision revision = 0) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (std::chrono::steady_clock::now() < until) {
    auto result = session.newest_result();
    if (result && result->is_final && result->revision >= revision &&
        result->check == Check::kDone && !result->awaits_modes)
      return result;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ADD_FAILURE() << "nothing settles";
  return nullptr;
}

}  // namespace limber::session::test
