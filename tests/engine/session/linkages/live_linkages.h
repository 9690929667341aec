#pragma once

#include <Eigen/Geometry>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/degrees.h"
#include "engine/scene/samples/linkage_samples.h"
#include "engine/session/linkages/session.h"
#include "tests/engine/session/bodies/harness.h"

namespace limber::session::testing {

using limber::kDegree;

/// Keeps what a session says of its states and shapes.
class LinkageRecorder : public LinkageListener {
 public:
  void on_progress(const Progress&) override {}
  void on_state(State state, const std::string& message) override {
    const std::lock_guard lock(mutex_);
    states_.push_back(state);
    message_ = message;
    changed_.notify_all();
  }
  /// From within the task, at the first intermediate shape.
  void cancel_on_iterate(LinkageSession& session) { cancelled_ = &session; }
  void on_result(const std::shared_ptr<const LinkageResult>& result) override {
    if (!result->is_final)
      if (LinkageSession* const session = cancelled_.exchange(nullptr)) session->cancel();
    const std::lock_guard lock(mutex_);
    gap_ = gap_ || result->sequence != results_.size() + 1;
    results_.push_back(result);
    changed_.notify_all();
  }

  /// Amendments do not count.
  std::shared_ptr<const LinkageResult> wait_final(Revision revision) {
    return wait_for([&](const LinkageResult& result) {
      return result.is_final && result.revision >= revision && result.check != Check::kDone;
    });
  }
  /// The same as it is published again when it has been checked.
  std::shared_ptr<const LinkageResult> wait_checked(Revision revision) {
    return wait_for([&](const LinkageResult& result) {
      return result.revision >= revision && result.check == Check::kDone;
    });
  }
  /// The first result of a revision; null where there is none.
  std::shared_ptr<const LinkageResult> first_of(Revision revision) const {
    const std::lock_guard lock(mutex_);
    for (const auto& result : results_)
      if (result->revision == revision) return result;
    return nullptr;
  }
  bool wait_state(State state) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(60),
                             [&] { return !states_.empty() && states_.back() == state; });
  }
  [[nodiscard]] bool has_gap() const { return gap_; }
  [[nodiscard]] std::string message() const { return message_; }

 private:
  template <class IsWanted>
  std::shared_ptr<const LinkageResult> wait_for(const IsWanted& is_wanted) {
    std::unique_lock lock(mutex_);
    std::shared_ptr<const LinkageResult> found;
    changed_.wait_for(lock, std::chrono::seconds(60), [&] {
      for (const auto& result : results_)
        if (is_wanted(*result)) found = result;
      return found != nullptr;
    });
    return found;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<const LinkageResult>> results_;
  std::vector<State> states_;
  std::string message_;
  bool gap_ = false;
  std::atomic<LinkageSession*> cancelled_ = nullptr;
};

/// A session, and who listens to it.
struct LiveSession {
  explicit LiveSession(scene::Linkage linkage, std::optional<RecalledAnswer> recalled = {})
      : session("live", std::move(linkage), {}, pool.executor(), recorder, std::move(recalled)) {}
  std::shared_ptr<LinkageRecorder> recorder = std::make_shared<LinkageRecorder>();
  test::Pool pool{1};
  LinkageSession session;

  std::shared_ptr<const LinkageResult> edit(const std::vector<LinkageEdit>& edits) {
    return recorder->wait_final(session.edit(edits).revision);
  }
};

inline scene::Linkage hyperboloid() {
  scene::Linkage linkage = scene::make_linkage_sample("hyperboloid");
  linkage.edges_per_segment = 5;
  linkage.conditions = {};  // free
  return linkage;
}

/// Where a joint is: the middle of the edge that its segment begins with.
inline Eigen::Vector3d joint_at(const LinkageSession& session, const LinkageResult& result,
                                int joint) {
  const auto geometry = session.geometry();
  const Eigen::VectorXd shape = result.frames->rightCols<1>();
  Eigen::Index at = 0;
  for (std::size_t s = 0; s < geometry->edges.size(); ++s) {
    const int edges = geometry->edges[s];
    for (int end = 0; end < 2; ++end) {
      if (geometry->joints_of_segment(end, static_cast<Eigen::Index>(s)) != joint) continue;
      const Eigen::Index first = at + 3 * Eigen::Index{end == 0 ? 0 : edges - 1};
      return (0.5 * (shape.segment<3>(first) + shape.segment<3>(first + 3))).cast<double>();
    }
    at += 6 * Eigen::Index{edges} + 3;
  }
  return Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
}

}  // namespace limber::session::testing
