#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>

namespace limber::server::store {

/// Space of the disk that a store holds for when there is no other left: a file that is deleted
/// then, so that what makes room can be written. One thread.
class Reserve {
 public:
  /// Size of the file: the log of removing a session, in parts, takes less [bytes].
  static constexpr std::uint64_t kBytes = 1 << 20;

  explicit Reserve(std::filesystem::path file) : file_(std::move(file)) {}

  /// Makes the file where it is missing and there is room; seldom, where there was none.
  void restore();
  /// @returns whether there was something to give
  bool give_up();

 private:
  [[nodiscard]] bool make() const;

  const std::filesystem::path file_;
  bool is_whole_ = false;
  std::chrono::steady_clock::time_point again_at_{};
};

}  // namespace limber::server::store
