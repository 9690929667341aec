#include "server/store/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "engine/base/error.h"

namespace limber::server::store {
namespace {

namespace fs = std::filesystem;

/// A new folder is private to its owner; an existing one keeps its mode.
std::error_code make_folder(const fs::path& folder) {
  std::error_code fault;
  if (fs::is_directory(folder, fault)) return {};
  const fs::path whole = fs::absolute(folder / "", fault).parent_path();  // without / behind it
  fs::create_directories(whole.parent_path(), fault);
  if (fault) return fault;
  if (::mkdir(whole.c_str(), 0700) != 0) return {errno, std::generic_category()};
  return {};
}

}  // namespace

FolderLock::FolderLock(const StoreOptions& options) {
  const fs::path& folder = options.folder;
  if (const std::error_code fault = make_folder(folder))
    throw Error(ErrorCode::kIo, "--data",
                fmt::format("the folder {} cannot be made: {}", folder.string(), fault.message()));
  const fs::path file = folder / "lock";
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor_ < 0)
    throw Error(ErrorCode::kIo, "--data",
                fmt::format("{} cannot be written: {}", file.string(), std::strerror(errno)));
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    ::close(descriptor_);
    throw Error(ErrorCode::kFailedPrecondition, "--data",
                fmt::format("another server has the folder {}", folder.string()));
  }
}

FolderLock::~FolderLock() { ::close(descriptor_); }

}  // namespace limber::server::store
