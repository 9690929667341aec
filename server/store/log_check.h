#pragma once

#include <cstdint>
#include <filesystem>

namespace limber::server::store {

/// Checks a write-ahead log of SQLite (https://www.sqlite.org/fileformat2.html, section 4). It
/// counts complete transactions after a damaged frame, at which SQLite silently stops reading. At
/// least 1 where the log's header is damaged; 0 where the log is sound, or cannot be read.
/// @param page_bytes  of the database: the log's own may be damaged
[[nodiscard]] std::uint64_t lost_transactions(const std::filesystem::path& log,
                                              std::uint64_t page_bytes);

}  // namespace limber::server::store
