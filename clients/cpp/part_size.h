#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace limber::client {

/// Bytes of a long answer to request at once. Answers to other requests of the connection pass
/// between two parts. One part should therefore take some hundredths of a second more than the
/// shortest did: the rest of its time is the round trip.
class PartSize {
 public:
  static constexpr std::uint64_t kLeast = 64u << 10, kMost = 4u << 20;
  static constexpr std::chrono::milliseconds kQuick{10}, kSlow{30};

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  /// How long a part of this size took from its request to its end.
  void note(std::chrono::steady_clock::duration time) {
    shortest_ = std::min(shortest_, time);
    const auto more = time - shortest_;
    if (more < kQuick) {
      bytes_ = std::min(2 * bytes_, kMost);
    } else if (more > kSlow) {
      bytes_ = std::max(bytes_ / 2, kLeast);
    }
  }

 private:
  std::uint64_t bytes_ = kLeast;
  std::chrono::steady_clock::duration shortest_ = std::chrono::steady_clock::duration::max();
};

}  // namespace limber::client
