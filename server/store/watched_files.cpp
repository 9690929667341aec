#include "server/store/watched_files.h"

#include <sys/stat.h>

namespace limber::server::store {
namespace {

struct Found {
  FileIdentity identity{};  // {} where there is no file: no file has inode 0
  std::uint64_t bytes = 0;
};

Found find(const std::filesystem::path& path) {
  struct stat file {};
  if (::stat(path.c_str(), &file) != 0) return {};
  return {{file.st_dev, file.st_ino}, static_cast<std::uint64_t>(file.st_size)};
}

}  // namespace

WatchedFiles::WatchedFiles(const StoreOptions& options)
    : options_(options), file_(find(options.file()).identity) {}

void WatchedFiles::remember_log() {
  log_ = find(options_.log()).identity;
  index_ = find(options_.log_index()).identity;
}

bool WatchedFiles::has_file() const {
  return file_ != FileIdentity{} && find(options_.file()).identity == file_;
}

WatchedFiles::Log WatchedFiles::log(const Database& database) const {
  if (log_ == FileIdentity{}) return Log::kSound;  // SQLite had to do without one
  const bool has_index = find(options_.log_index()).identity == index_;
  // Another process may cut off a log right after it has folded it, so the index is read after the
  // length.
  const Found log = find(options_.log());
  if (log.identity == FileIdentity{}) return has_index ? Log::kRemoved : Log::kReplaced;
  if (log.identity != log_ || !has_index) return Log::kReplaced;
  const auto index = database.log_index();
  return index && log.bytes < index->bytes() ? Log::kCutOff : Log::kSound;
}

}  // namespace limber::server::store
