#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>

namespace limber::server::store {

/// What an acknowledged change outlives.
enum class Durability {
  kProcess,  // the end of the process, kill -9 included: written, left to the system to sync
  kPower,    // the end of the machine, too: synced before it is acknowledged
};

/// Replies are known for so long.
inline constexpr std::uint64_t kReplySeconds = 600;
/// Limit for one client, and of the bytes; older ones are removed. It equals the number that a
/// running server remembers of a client (StoredReplies::Limits). The data in memory, in the file
/// and at the start stay small after any number of requests.
inline constexpr std::uint64_t kRepliesOfClient = 256, kReplyBytesOfClient = 1 << 20;

/// Limit of the write-ahead log: SQLite folds it into the file at about half of that, and releases
/// the rest. While another process reads the file, it cannot, and the log grows [bytes].
inline constexpr std::uint64_t kLogBytes = 8 << 20;
/// A log that could not be folded for so many bytes is worth a warning.
inline constexpr std::uint64_t kUnfoldedBytes = 2 * kLogBytes;

struct StoreOptions {
  /// For a bounded file: an empty one takes about half of that.
  static constexpr std::uint64_t kLeastBytes = 64 << 10;

  std::filesystem::path folder;
  Durability durability = Durability::kPower;
  /// Limit of the file without its log; changes beyond it are refused. 0: the size of the disk.
  std::uint64_t bytes = 0;
  /// Sessions without changes for so long are removed at the start; 0: none.
  std::chrono::seconds retain{0};
  /// Stored edits of a session before a checkpoint replaces them, about; 0: all stay.
  std::uint64_t checkpoint_edits = 2000;
  /// Between attempts to write what could not be written.
  std::chrono::milliseconds retry{500};

  [[nodiscard]] std::filesystem::path file() const { return folder / "sessions.sqlite"; }
  /// SQLite's own log, in the same folder.
  [[nodiscard]] std::filesystem::path log() const { return folder / "sessions.sqlite-wal"; }
  [[nodiscard]] std::filesystem::path log_index() const { return folder / "sessions.sqlite-shm"; }
  [[nodiscard]] std::filesystem::path reserve() const { return folder / "sessions.reserve"; }
  /// @throws Error{kInvalidArgument} naming the option
  void validate() const;
};

}  // namespace limber::server::store
