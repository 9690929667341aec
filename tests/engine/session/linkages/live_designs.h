#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "engine/session/linkages/session.h"
#include "tests/engine/session/bodies/harness.h"

namespace limber::session::testing {

/// Keeps what a session says of its designs.
class Watcher : public LinkageListener {
 public:
  void on_progress(const Progress&) override {}
  void on_state(State, const std::string&) override {}
  void on_result(const std::shared_ptr<const LinkageResult>& result) override {
    const std::lock_guard lock(mutex_);
    results_.push_back(result);
    changed_.notify_all();
  }
  void on_design(const std::shared_ptr<const DesignInfo>& info) override {
    if (hook) hook(*info);
    const std::lock_guard lock(mutex_);
    infos_.push_back(info);
    changed_.notify_all();
  }
  std::function<void(const DesignInfo&)> hook;  // within the task

  std::shared_ptr<const LinkageResult> wait_final(Revision revision) {
    std::shared_ptr<const LinkageResult> found;
    wait([&] {
      for (const auto& result : results_)
        if (result->is_final && result->revision >= revision) found = result;
      return found != nullptr;
    });
    return found;
  }
  std::shared_ptr<const DesignInfo> wait_design(
      const std::function<bool(const DesignInfo&)>& wanted) {
    std::shared_ptr<const DesignInfo> found;
    wait([&] {
      for (const auto& info : infos_)
        if (!found && wanted(*info)) found = info;
      return found != nullptr;
    });
    return found;
  }
  std::shared_ptr<const DesignInfo> wait_end() {
    return wait_design([](const DesignInfo& info) { return info.state == DesignState::kEnded; });
  }
  [[nodiscard]] std::vector<std::shared_ptr<const DesignInfo>> infos() const {
    const std::lock_guard lock(mutex_);
    return infos_;
  }
  [[nodiscard]] std::vector<std::shared_ptr<const LinkageResult>> results() const {
    const std::lock_guard lock(mutex_);
    return results_;
  }
  void forget() {
    const std::lock_guard lock(mutex_);
    infos_.clear();
  }

 private:
  template <class Done>
  void wait(const Done& done) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::seconds(60), done);
  }
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<const LinkageResult>> results_;
  std::vector<std::shared_ptr<const DesignInfo>> infos_;
};

/// Five by five strips aslant, in millimetres, their lengths a little uneven.
inline scene::Linkage curved_grid() {
  constexpr int kLines = 5;
  scene::Linkage linkage;
  linkage.name = "curved";
  linkage.length_unit_in_metres = 1e-3;
  auto& mesh = linkage.lines;
  mesh.vertices.resize(3, kLines * kLines);
  std::vector<Eigen::Vector2i> edges;
  for (int i = 0; i < kLines; ++i) {
    for (int k = 0; k < kLines; ++k) {
      const Eigen::Vector2d at(40 * (i + k * std::cos(0.6)), 40 * k * std::sin(0.6));
      const int vertex = i * kLines + k;
      mesh.vertices.col(vertex) << at.x() + 4 * std::sin(0.03 * at.y()),
          at.y() + 3 * std::sin(0.025 * at.x()), 6 * std::sin(0.02 * (at.x() + at.y()));
      if (i > 0) edges.emplace_back(vertex - kLines, vertex);
      if (k > 0) edges.emplace_back(vertex - 1, vertex);
    }
  }
  mesh.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t e = 0; e < edges.size(); ++e)
    mesh.edges.col(static_cast<Eigen::Index>(e)) = edges[e];
  linkage.edges_per_segment = 5;
  linkage.section = rods::Rectangle{6, 1.5};
  linkage.conditions.mean_angle = 1.0;
  return linkage;
}

struct LiveDesignSession {
  explicit LiveDesignSession(scene::Linkage linkage = curved_grid())
      : session("live", std::move(linkage), {}, pool.executor(), watcher) {
    EXPECT_TRUE(watcher->wait_final(0));
  }
  std::shared_ptr<const LinkageResult> edit(const std::vector<LinkageEdit>& edits) {
    return watcher->wait_final(session.edit(edits).revision);
  }
  [[nodiscard]] Eigen::Matrix3Xd joints(const LinkageResult& result) const {
    return session.shape()->joints(result.frames->rightCols<1>());
  }
  [[nodiscard]] Eigen::VectorXd lengths() const { return session.conditions()->segment_lengths; }
  std::shared_ptr<Watcher> watcher = std::make_shared<Watcher>();
  test::Pool pool{1};
  LinkageSession session;
};

/// Where the joints of the deployed linkage are with other rest lengths: known to be reachable.
inline std::vector<rods::JointTarget> known_targets() {
  LiveDesignSession other;
  const auto before = other.watcher->wait_final(0);
  EXPECT_FALSE(before->solve_failed) << before->report.message;
  Random random(17);
  Eigen::VectorXd lengths(other.session.geometry()->joints_of_segment.cols());
  const auto& mesh = curved_grid().lines;
  for (Eigen::Index s = 0; s < lengths.size(); ++s) {
    lengths[s] =
        (mesh.vertices.col(mesh.edges(1, s)) - mesh.vertices.col(mesh.edges(0, s))).norm() *
        random.uniform(0.99, 1.01);
  }
  // Held where a design holds it.
  const auto shape = other.edit({SetSegmentLengths{lengths}});
  EXPECT_FALSE(shape->solve_failed) << shape->report.message;
  const Eigen::Matrix3Xd joints = other.joints(*shape);
  std::vector<rods::JointTarget> targets;
  for (int j = 0; j < joints.cols(); ++j) targets.push_back({j, joints.col(j), 1});
  return targets;
}

inline DesignRequest request() {
  static const std::vector<rods::JointTarget> kTargets = known_targets();
  DesignRequest request;
  request.goal.targets = kTargets;
  request.goal.distance_weight = 1e8;
  request.flat_height = 0.3;
  return request;
}

/// Field of what `call` is refused with.
template <class Call>
std::string refused_field(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.field();
  }
  return "none";
}

}  // namespace limber::session::testing
