#pragma once

#include <atomic>

namespace limber::server {

/// A number that may be changed while others read it. Used as the number that it holds.
template <class T>
class Live {
 public:
  Live(T value = {}) noexcept : value_(value) {}
  Live(const Live& other) noexcept : value_(static_cast<T>(other)) {}
  ~Live() = default;
  Live& operator=(const Live& other) noexcept {
    if (this != &other) value_.store(static_cast<T>(other), std::memory_order_relaxed);
    return *this;
  }
  operator T() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<T> value_;
};

}  // namespace limber::server
