#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "server/transport/topic_slots.h"

namespace limber::server {

/// Bytes of stream messages that somebody still holds: queues, libzmq, connections of pages. Each
/// message counts once, however many it is for. Thread-safe.
class LiveBytes {
 public:
  /// The messages count until their last owner releases them, which may outlive this.
  [[nodiscard]] SharedMessages counted(std::vector<StreamBytes> messages) {
    auto held = std::make_shared<Held>(std::move(messages), total_);
    const auto* content = &held->messages;
    return {std::move(held), content};
  }
  [[nodiscard]] std::uint64_t total() const { return total_->load(std::memory_order_relaxed); }

 private:
  using Total = std::shared_ptr<std::atomic<std::uint64_t>>;
  struct Held {
    Held(std::vector<StreamBytes> given, Total counted)
        : messages(std::move(given)), total(std::move(counted)) {
      for (const auto& message : messages) bytes += message.capacity();
      total->fetch_add(bytes, std::memory_order_relaxed);
    }
    ~Held() { total->fetch_sub(bytes, std::memory_order_relaxed); }
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    const std::vector<StreamBytes> messages;
    const Total total;
    std::uint64_t bytes = 0;
  };
  Total total_ = std::make_shared<std::atomic<std::uint64_t>>(0);
};

}  // namespace limber::server
