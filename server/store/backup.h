#pragma once

#include <cstdint>
#include <filesystem>

namespace limber::server::store {

struct Backup {
  std::uint64_t sessions = 0, bytes = 0;
};
enum class Existing { kIsRefused, kIsReplaced };

/// Copies the store of a folder into one file, in its state at one moment. A server may have the
/// folder and go on meanwhile. The copy gets its name once it is whole, sound, and on the disk.
/// @param existing  what becomes of a file that has the name
/// @throws Error naming "folder" or "file": kNotFound, kFailedPrecondition where there is no store
/// or a file has the name, kIo where it cannot be read or written, or is damaged
Backup back_up(const std::filesystem::path& folder, const std::filesystem::path& file,
               Existing existing);

}  // namespace limber::server::store
