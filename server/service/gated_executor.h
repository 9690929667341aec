#pragma once

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
    return [gate = gate_](session::Executor::Task task, session::Urgency urgency) {
      gate->run({std::move(task), urgency});
    };
  }
  void open() { gate_->open(); }

 private:
  class Gate {
   public:
    struct Given {
      session::Executor::Task task;
      session::Urgency urgency;
    };
    explicit Gate(session::Executor executor) : executor_(std::move(executor)) {}
    void run(Given given) {
      {
        const std::lock_guard lock(mutex_);
        if (!is_open_) {
          waiting_.push_back(std::move(given));
          return;
        }
      }
      executor_(std::move(given.task), given.urgency);
    }
    void open() {
      std::vector<Given> waiting;
      {
        const std::lock_guard lock(mutex_);
        is_open_ = true;
        waiting.swap(waiting_);
      }
      for (auto& given : waiting) executor_(std::move(given.task), given.urgency);
    }

   private:
    const session::Executor executor_;
    std::mutex mutex_;
    bool is_open_ = false;
    std::vector<Given> waiting_;
  };

  const std::shared_ptr<Gate> gate_;
};

}  // namespace limber::server
