#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>

#include "server/wire/frame_source.h"

namespace limber::server {

/// The results of one session that clients fetch in parts, kept so that all parts of a motion are
/// of the same one although edits continue. Any thread.
class FrameTransfers {
 public:
  using Clock = std::chrono::steady_clock;
  /// Results at a time; the one that was asked for longest ago goes.
  static constexpr std::size_t kMostResults = 8;
  /// One that nobody has asked for so long goes when the next transfer begins.
  static constexpr std::chrono::seconds kPatience{60};

  /// Parts of this result will be asked for.
  void begin(std::shared_ptr<const FrameSource> result, Clock::time_point now);
  /// @param sequence  of a result whose transfer has begun
  /// @throws Error{kFailedPrecondition, "result_sequence"}
  [[nodiscard]] std::shared_ptr<const FrameSource> find(std::uint64_t sequence,
                                                        Clock::time_point now);
  /// The last part was made: of as many transfers as have begun.
  void end(std::uint64_t sequence);

 private:
  struct Kept {
    std::shared_ptr<const FrameSource> result;
    int transfers = 0;
    Clock::time_point asked;
  };
  std::list<Kept>::iterator look_up(std::uint64_t sequence);  // with the lock

  std::mutex mutex_;
  std::list<Kept> kept_;  // asked for longest ago first
};

}  // namespace limber::server
