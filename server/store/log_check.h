#pragma once

#include <cstdint>
#include <filesystem>

namespace limber::server::store {

/// Of a write-ahead log of SQLite (https://www.sqlite.org/fileformat2.html, section 4):
/// transactions that were written behind the part that SQLite has read, which ends without a word
/// where a frame is not as it was written. 0 where the log is whole, or cannot be read.
/// @param frames  that SQLite has read
/// @param page_bytes  of the database: the log's own may be damaged
[[nodiscard]] std::uint64_t lost_transactions(const std::filesystem::path& log,
                                              std::uint64_t frames, std::uint64_t page_bytes);

}  // namespace limber::server::store
