#pragma once

#include <cstdint>
#include <filesystem>

namespace limber::server::store {

/// Of a write-ahead log of SQLite (https://www.sqlite.org/fileformat2.html, section 4):
/// transactions that were written behind the part that SQLite has read, which ends without a word
/// where a frame is not as it was written. 0 where the log is whole, or cannot be read.
/// @param frames  that SQLite has read
[[nodiscard]] std::uint64_t lost_transactions(const std::filesystem::path& log,
                                              std::uint64_t frames);

}  // namespace limber::server::store
