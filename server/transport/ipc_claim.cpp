#include "server/transport/ipc_claim.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <thread>

#include "engine/base/error.h"

namespace limber::server {
namespace {

constexpr std::string_view kIpcScheme = "ipc://";

// A server that starts has the lock for milliseconds.
constexpr int kLockTries = 20;
constexpr std::chrono::milliseconds kBetweenLockTries{50};

enum class FolderLock { kOurs, kOthers };

/// kOurs also where the file system has no locks.
FolderLock lock_in_time(int folder) {
  for (int left = kLockTries; ::flock(folder, LOCK_EX | LOCK_NB) != 0; --left) {
    if (errno != EWOULDBLOCK && errno != EINTR) return FolderLock::kOurs;
    if (left == 0) return FolderLock::kOthers;
    std::this_thread::sleep_for(kBetweenLockTries);
  }
  return FolderLock::kOurs;
}

/// Also of a server that hangs: its kernel queue takes the connection, or is full.
bool somebody_listens(const std::string& path) {
  sockaddr_un address{};
  if (path.size() >= sizeof address.sun_path) return false;  // libzmq refuses it
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  const int file = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (file < 0) return false;
  const int fault =
      ::connect(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ? 0 : errno;
  ::close(file);
  return fault == 0 || fault == EAGAIN || fault == EINPROGRESS || fault == EACCES;
}

}  // namespace

IpcClaim::IpcClaim(const std::string& endpoint, const char* option) {
  if (!endpoint.starts_with(kIpcScheme)) return;
  const std::string path = endpoint.substr(kIpcScheme.size());
  if (path == "*" || path.starts_with('@')) return;  // any free one; abstract: the kernel refuses
  const auto folder = std::filesystem::path(path).parent_path();
  folder_ = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  struct stat status {};
  std::string fault;
  if (folder_ >= 0 && lock_in_time(folder_) == FolderLock::kOthers) {
    fault = "another process has locked the folder; choose another one";
  } else if (::lstat(path.c_str(), &status) == 0) {
    if (!S_ISSOCK(status.st_mode)) {
      fault = "there is a file that is no socket; remove it or choose another path";
    } else if (somebody_listens(path)) {
      fault = "another server listens there; stop it or choose another path";
    }
  }
  if (fault.empty()) return;
  if (folder_ >= 0) ::close(folder_);
  throw Error(ErrorCode::kIo, option, fmt::format("cannot bind {}: {}", endpoint, fault));
}

IpcClaim::~IpcClaim() {
  if (folder_ >= 0) ::close(folder_);
}

}  // namespace limber::server
