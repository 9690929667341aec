#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "server/store/options.h"
#include "server/store/sqlite.h"

namespace limber::server::store {

/// Device and inode: which file it is, of those that have had its name.
using FileIdentity = std::pair<std::uint64_t, std::uint64_t>;

/// The files of a store that is open, by their names: whether these are still the files that SQLite
/// writes to. Data written to a file without a name are lost with the process. One thread.
class WatchedFiles {
 public:
  /// Remembers the file of the store. @pre it is open
  explicit WatchedFiles(const StoreOptions& options);
  /// Remembers the log and its index, where there are any.
  void remember_log();

  [[nodiscard]] bool has_file() const;
  enum class Log {
    kSound,
    kRemoved,   // no file has its name, and SQLite alone has its content
    kReplaced,  // another file has its name, or that of its index
    kCutOff,    // it is shorter than its committed frames
  };
  [[nodiscard]] Log log(const Database& database) const;

 private:
  const StoreOptions options_;
  const FileIdentity file_;
  FileIdentity log_{}, index_{};
};

}  // namespace limber::server::store
