#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace limber::server {

/// How long something took, of all of its kind since the start: how often, by classes of time. Any
/// thread.
class Latencies {
 public:
  /// Upper ends of the classes [s]; one more is of what took longer.
  static constexpr std::array<double, 16> kBounds{50e-6, 100e-6, 250e-6, 500e-6, 1e-3, 2.5e-3,
                                                  5e-3,  10e-3,  25e-3,  50e-3,  0.1,  0.25,
                                                  0.5,   1.0,    2.5,    10.0};

  void note(std::chrono::nanoseconds took) noexcept {
    const auto ns = static_cast<std::uint64_t>(std::max<std::int64_t>(0, took.count()));
    const auto bound =
        std::lower_bound(kBounds.begin(), kBounds.end(), static_cast<double>(ns) * 1e-9);
    counts_[static_cast<std::size_t>(bound - kBounds.begin())].fetch_add(1,
                                                                         std::memory_order_relaxed);
    sum_ns_.fetch_add(ns, std::memory_order_relaxed);
    std::uint64_t longest = longest_ns_.load(std::memory_order_relaxed);
    while (longest < ns && !longest_ns_.compare_exchange_weak(longest, ns)) continue;
  }

  [[nodiscard]] std::uint64_t count(std::size_t which) const {
    return counts_.at(which).load(std::memory_order_relaxed);
  }
  [[nodiscard]] double sum_s() const { return static_cast<double>(sum_ns_.load()) * 1e-9; }
  [[nodiscard]] double longest_s() const { return static_cast<double>(longest_ns_.load()) * 1e-9; }

 private:
  std::array<std::atomic<std::uint64_t>, kBounds.size() + 1> counts_{};
  std::atomic<std::uint64_t> sum_ns_{0}, longest_ns_{0};
};

}  // namespace limber::server
