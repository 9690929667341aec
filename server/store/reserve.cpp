#include "server/store/reserve.h"

#include <fcntl.h>
#include <unistd.h>

#include <system_error>

#include "server/log/log.h"

namespace limber::server::store {

namespace fs = std::filesystem;

void Reserve::restore() {
  const auto now = std::chrono::steady_clock::now();
  if (is_whole_ || now < again_at_) return;
  is_whole_ = make();
  again_at_ = now + std::chrono::seconds(10);
}

bool Reserve::give_up() {
  std::error_code fault;
  is_whole_ = false;
  again_at_ = {};
  const bool was_there = fs::file_size(file_, fault) > 0 && !fault && fs::remove(file_, fault);
  if (was_there)
    log::warn("the disk is full: the store gives up its reserve, {} bytes, to make room", kBytes);
  return was_there;
}

/// Blocks of the disk, no hole: a hole would hold nothing.
bool Reserve::make() const {
  const int file = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) return false;
  const bool is_made = ::posix_fallocate(file, 0, static_cast<off_t>(kBytes)) == 0;
  ::close(file);
  if (!is_made) {
    std::error_code ignored;
    fs::remove(file_, ignored);  // of a part nothing could be written
  }
  return is_made;
}

}  // namespace limber::server::store
