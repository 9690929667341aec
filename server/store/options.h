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
/// Of one client, at most, and their bytes; older ones go. As many as a server knows of a client
/// while it runs (StoredReplies::Limits): what is kept in memory, in the file and read at the start
/// stays small behind any number of requests.
inline constexpr std::uint64_t kRepliesOfClient = 256, kReplyBytesOfClient = 1 << 20;

/// Of the write-ahead log: SQLite folds it into the file at about half of that, and gives back what
/// is beyond. While another process reads the file, it cannot, and the log grows [bytes].
inline constexpr std::uint64_t kLogBytes = 8 << 20;
/// A log that could not be folded for so many bytes is worth a warning.
inline constexpr std::uint64_t kUnfoldedBytes = 2 * kLogBytes;

struct StoreOptions {
  /// Of a file that is bounded: an empty one takes about half of that.
  static constexpr std::uint64_t kLeastBytes = 64 << 10;

  std::filesystem::path folder;
  Durability durability = Durability::kPower;
  /// Of the file without its log, at most; changes beyond it are refused. 0: what the disk holds.
  std::uint64_t bytes = 0;
  /// Sessions that nobody has changed for so long are removed at the start; 0: none.
  std::chrono::seconds retain{0};
  /// Edits of a session that are stored before a checkpoint stands for them, about; 0: all stay.
  std::uint64_t checkpoint_edits = 2000;
  /// Between attempts to write what could not be written.
  std::chrono::milliseconds retry{500};

  [[nodiscard]] std::filesystem::path file() const { return folder / "sessions.sqlite"; }
  /// SQLite's own, beside it.
  [[nodiscard]] std::filesystem::path log() const { return folder / "sessions.sqlite-wal"; }
  [[nodiscard]] std::filesystem::path log_index() const { return folder / "sessions.sqlite-shm"; }
  [[nodiscard]] std::filesystem::path reserve() const { return folder / "sessions.reserve"; }
  /// @throws Error{kInvalidArgument} naming the option
  void validate() const;
};

}  // namespace limber::server::store
