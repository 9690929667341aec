#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/wire/frame_source.h"

namespace limber::server {

/// Results of one session that clients fetch in parts, with the bases of their coordinates: all
/// parts of a motion are of the same result although edits continue. Any thread.
class FrameTransfers {
 public:
  using Clock = std::chrono::steady_clock;
  /// Bytes of all results and bases that are kept; one result always has room.
  static constexpr std::uint64_t kMostBytes = std::uint64_t{256} << 20;
  /// A result without requests for so long is removed by the next sweep.
  static constexpr std::chrono::seconds kPatience{60};
  /// The same if its last part was requested last: that part, and its basis, may be requested
  /// again.
  static constexpr std::chrono::seconds kPatienceBehindLast{10};

  explicit FrameTransfers(std::uint64_t most_bytes = kMostBytes) : most_bytes_(most_bytes) {}

  /// For the case that there is no room even without results whose last part was fetched.
  enum class WithoutRoom {
    kBeginNone,
    kDisplace,  // the result with the oldest request is removed
  };
  /// Begins the transfer of this result. If there is no room for it, parts come from an earlier one
  /// that shows the same revision, if neither it nor another like it is final.
  /// @returns the result that they are of; null: none has begun
  [[nodiscard]] std::shared_ptr<const FrameSource> begin(std::shared_ptr<const FrameSource> result,
                                                         WithoutRoom without,
                                                         Clock::time_point now);
  /// @param sequence  of a result whose transfer has begun
  /// @throws Error{kFailedPrecondition, "result_sequence"}
  [[nodiscard]] std::shared_ptr<const FrameSource> find(std::uint64_t sequence,
                                                        Clock::time_point now);
  /// The last part of it was made, by one of those that fetch it.
  void note_last(std::uint64_t sequence);
  /// The newest result with frames of this basis; null: there is none.
  [[nodiscard]] std::shared_ptr<const FrameSource> find_basis(const std::string& basis_hash,
                                                              Clock::time_point now);
  /// Releases results that are no longer fetched. @returns whether there were any
  bool sweep(Clock::time_point now);
  /// Bytes of all retained results, besides the data of the session itself.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  struct Kept {
    std::shared_ptr<const FrameSource> result;
    Clock::time_point asked;
    bool is_last_made = false;  // and nothing was requested since
  };
  using List = std::list<Kept>;

  // With the lock:
  List::iterator look_up(std::uint64_t sequence);
  void touch(List::iterator kept, Clock::time_point now);
  void add(const std::shared_ptr<const FrameSource>& result, Clock::time_point now);
  void move_to(List& gone, List::iterator kept);
  void move_expired(Clock::time_point now, List& gone);
  [[nodiscard]] std::uint64_t bytes_of_all() const;

  const std::uint64_t most_bytes_;
  mutable std::mutex mutex_;
  List kept_;  // oldest request first
  /// Bases of the retained results, each once.
  struct Basis {
    std::size_t results = 0;
    std::uint64_t bytes = 0;
  };
  std::map<std::string, Basis> bases_;  // by hash
  std::uint64_t bytes_ = 0;             // of results and bases
  std::uint64_t newest_ = 0;            // sequence
  std::string newest_basis_;            // the session has that
};

}  // namespace limber::server
