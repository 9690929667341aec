#pragma once

#include <cstdint>
#include <filesystem>

#include "server/store/options.h"

namespace limber::server::store {

/// [bytes] 0 where there is no such file.
[[nodiscard]] std::uint64_t length_of(const std::filesystem::path& file);

/// Called before SQLite opens the file of a store: it would take a truncated file for a new one and
/// remove its log. Makes the file where there is none, readable by its owner alone: SQLite gives
/// its log the same mode.
/// @throws Error{kFailedPrecondition, "--data"} where a store was there and its file is not
void prepare_store_file(const StoreOptions& options);

}  // namespace limber::server::store
