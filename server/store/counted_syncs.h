#pragma once

#include <cstdint>

namespace limber::server::store {

/// How often the files of stores were synced to the disk, and for how long, of all stores of this
/// process. Any thread.
struct Syncs {
  std::uint64_t count = 0;
  double seconds = 0;

  [[nodiscard]] static Syncs now();
};

/// The name of a VFS of SQLite: its default one, with syncs counted (https://sqlite.org/vfs.html).
/// Any thread. @returns null, which is the default one, where it could not be made
[[nodiscard]] const char* counting_vfs();

}  // namespace limber::server::store
