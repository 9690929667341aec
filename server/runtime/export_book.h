#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <utility>

#include "engine/base/error.h"

namespace limber::server {

/// The results that exports of one session are made of, kept so that all parts of an export agree
/// although edits continue. Any thread.
template <class Result>
class ExportBook {
 public:
  void begin(std::shared_ptr<const Result> result) {
    constexpr std::size_t kExportsAtOnce = 4;
    std::shared_ptr<const Result> oldest;  // freed without the lock
    const std::lock_guard lock(mutex_);
    std::erase(results_, result);
    results_.push_back(std::move(result));
    if (results_.size() <= kExportsAtOnce) return;
    oldest = std::move(results_.front());
    results_.pop_front();
  }

  /// @param sequence  of an export begun before, 0 for the newest of those
  /// @throws Error{kFailedPrecondition, "result_sequence"}
  [[nodiscard]] std::shared_ptr<const Result> find(std::uint64_t sequence) const {
    const std::lock_guard lock(mutex_);
    for (auto it = results_.rbegin(); it != results_.rend(); ++it) {
      if (sequence == 0 || (*it)->sequence == sequence) return *it;
    }
    throw Error(ErrorCode::kFailedPrecondition, "result_sequence", "begin the export with part 0");
  }

 private:
  mutable std::mutex mutex_;
  std::deque<std::shared_ptr<const Result>> results_;  // newest last
};

}  // namespace limber::server
