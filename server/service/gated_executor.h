#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "engine/session/core/executor.h"

namespace limber::server {

/// An executor that keeps tasks back until it is opened. Thread-safe.
class GatedExecutor {
 public:
  explicit GatedExecutor(session::Executor executor)
      : gate_(std::make_shared<Gate>(std::move(executor))) {}

  /// May outlive this.
  [[nodiscard]] session::Executor executor() const {
    return [gate = gate_](std::function<void()> task) { gate->run(std::move(task)); };
  }
  void open() { gate_->open(); }

 private:
  class Gate {
   public:
    explicit Gate(session::Executor executor) : executor_(std::move(executor)) {}
    void run(std::function<void()> task) {
      {
        const std::lock_guard lock(mutex_);
        if (!is_open_) {
          waiting_.push_back(std::move(task));
          return;
        }
      }
      executor_(std::move(task));
    }
    void open() {
      std::vector<std::function<void()>> waiting;
      {
        const std::lock_guard lock(mutex_);
        is_open_ = true;
        waiting.swap(waiting_);
      }
      for (auto& task : waiting) executor_(std::move(task));
    }

   private:
    const session::Executor executor_;
    std::mutex mutex_;
    bool is_open_ = false;
    std::vector<std::function<void()>> waiting_;
  };

  const std::shared_ptr<Gate> gate_;
};

}  // namespace limber::server
