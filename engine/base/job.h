#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "engine/base/error.h"

namespace limber {

/// A handle to a shared flag: copies see the same request. Thread-safe.
class Cancellation {
 public:
  void request() const noexcept { flag_->store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool requested() const noexcept { return flag_->load(std::memory_order_relaxed); }

 private:
  std::shared_ptr<std::atomic<bool>> flag_ = std::make_shared<std::atomic<bool>>(false);
};

/// Controls that a caller passes to long work: cancellation and reports of progress.
struct JobContext {
  Cancellation cancellation;
  /// Called from the working thread; fraction in [0, 1] over the whole job. May be empty.
  std::function<void(const std::string& stage, double fraction)> progress;

  /// Reports and throws Error{kCancelled} if the caller asked to stop. Call at least every 50 ms of
  /// work.
  void report(const std::string& stage, double fraction) const {
    throw_if_cancelled();
    if (progress) progress(stage, fraction);
  }
  void throw_if_cancelled() const {
    if (cancellation.requested()) throw Error(ErrorCode::kCancelled, "", "cancelled by the caller");
  }
  /// A context whose [0, 1] is [from, to] of this one.
  [[nodiscard]] JobContext part(double from, double to) const {
    JobContext inner{cancellation, {}};
    if (progress) {
      inner.progress = [outer = progress, from, to](const std::string& stage, double fraction) {
        outer(stage, from + (to - from) * fraction);
      };
    }
    return inner;
  }
};

}  // namespace limber
