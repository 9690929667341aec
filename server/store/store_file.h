#pragma once

#include <cstdint>
#include <filesystem>

#include "server/store/options.h"

namespace limber::server::store {

/// [bytes] 0 where there is no such file.
[[nodiscard]] std::uint64_t length_of(const std::filesystem::path& file);

/// Before SQLite opens the file of a store, which it would take for a new one where the file was
/// cut off, and it would remove the log beside it. Makes the file where there is none, readable by
/// its owner alone: SQLite gives its log the same mode.
/// @throws Error{kFailedPrecondition, "--data"} where a store was there and its file is not
void prepare_store_file(const StoreOptions& options);

}  // namespace limber::server::store
