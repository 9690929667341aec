#pragma once

#include <cstdint>
#include <optional>

struct sqlite3;

namespace limber::server::store {

/// How often the files of stores were synced to the disk, and for how long, of all stores of this
/// process. Any thread.
struct Syncs {
  std::uint64_t count = 0;
  double seconds = 0;

  [[nodiscard]] static Syncs now();
};

/// The name of a VFS of SQLite: its default one, with syncs counted and the index of the
/// write-ahead log known (https://sqlite.org/vfs.html). Any thread.
/// @returns null, which is the default one, where it could not be made
[[nodiscard]] const char* store_vfs();

/// The content of a write-ahead log's index, which all its readers and writers share in memory
/// (https://sqlite.org/walformat.html, section 2).
struct LogIndex {
  std::uint64_t frames = 0;      // that are committed
  std::uint64_t folded = 0;      // of these, the first ones that the database has, too
  std::uint64_t page_bytes = 0;  // of each frame, without its header

  /// [bytes] Of the log up to its last committed frame.
  [[nodiscard]] std::uint64_t bytes() const;
  /// [bytes] Of frames that the database has not.
  [[nodiscard]] std::uint64_t unfolded_bytes() const { return (frames - folded) * page_bytes; }
};
/// By the thread that uses the connection. @returns nothing without store_vfs(), or without a log
[[nodiscard]] std::optional<LogIndex> log_index(sqlite3* connection);

}  // namespace limber::server::store
