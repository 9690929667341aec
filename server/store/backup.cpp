#include "server/store/backup.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "engine/base/error.h"
#include "server/store/options.h"
#include "server/store/sqlite.h"
#include "server/store/store_file.h"

namespace limber::server::store {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(ErrorCode code, const char* field, const std::string& words) {
  throw Error(code, field, words);
}

/// A copy that is being made; it goes where it does not become whole.
class Part {
 public:
  explicit Part(const fs::path& whole) : path_(whole.string() + ".part") {
    std::error_code ignored;
    fs::remove(path_, ignored);
    const int made = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    if (made < 0)
      fail(ErrorCode::kIo, "file",
           fmt::format("{} cannot be written: {}", path_.string(), std::strerror(errno)));
    ::close(made);
  }
  ~Part() {
    std::error_code ignored;
    for (const char* ending : {"", "-wal", "-shm", "-journal"})
      fs::remove(path_.string() + ending, ignored);
  }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }
  /// It is on the disk, under its name, before this returns.
  void become(const fs::path& whole) const {
    sync(path_);
    std::error_code fault;
    fs::rename(path_, whole, fault);
    if (fault)
      fail(ErrorCode::kIo, "file",
           fmt::format("{} cannot be written: {}", whole.string(), fault.message()));
    sync(fs::absolute(whole).parent_path());
  }

 private:
  static void sync(const fs::path& path) {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    const bool is_synced = file >= 0 && ::fsync(file) == 0;
    const std::string why = is_synced ? "" : std::strerror(errno);
    if (file >= 0) ::close(file);
    if (!is_synced)
      fail(ErrorCode::kIo, "file", fmt::format("{} cannot be written: {}", path.string(), why));
  }

  const fs::path path_;
};

/// @returns the number of sessions
std::uint64_t check(const fs::path& copy, const fs::path& store) {
  Database database(copy, Database::Access::kWrite);
  database.run("PRAGMA journal_mode = DELETE");  // a copy is one file, without a separate log
  auto found = database.prepare("PRAGMA quick_check(1)");
  if (found.step() && found.bytes(0) != "ok")
    fail(ErrorCode::kIo, "folder",
         fmt::format("{} is damaged, and no copy is made ({})", store.string(), found.bytes(0)));
  auto tables = database.prepare(
      "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND"
      " name IN ('form', 'sessions', 'edits', 'answers')");
  if (!tables.step() || tables.number(0) != 4)
    fail(ErrorCode::kFailedPrecondition, "folder",
         fmt::format("{} is not a store of limberd", store.string()));
  auto sessions = database.prepare("SELECT count(*) FROM sessions");
  return sessions.step() ? sessions.number(0) : 0;
}

}  // namespace

Backup back_up(const fs::path& folder, const fs::path& file, Existing existing) {
  StoreOptions options;
  options.folder = folder;
  std::error_code ignored;
  if (!fs::is_regular_file(options.file(), ignored))
    fail(ErrorCode::kNotFound, "folder",
         fmt::format("there is no store in {}: {} is missing", folder.string(),
                     options.file().string()));
  for (const fs::path& own : {options.file(), options.log(), options.log_index()}) {
    if (fs::weakly_canonical(file, ignored) == fs::weakly_canonical(own, ignored))
      fail(ErrorCode::kFailedPrecondition, "file",
           fmt::format("{} is a file of the store itself", file.string()));
  }
  if (existing == Existing::kIsRefused && fs::exists(file, ignored))
    fail(ErrorCode::kFailedPrecondition, "file",
         fmt::format("{} is there: name another file, or give --replace", file.string()));
  const Part part(file);
  Backup backup;
  Database(options.file(), Database::Access::kRead).copy_to(part.path());
  backup.sessions = check(part.path(), options.file());
  backup.bytes = length_of(part.path());
  part.become(file);
  return backup;
}

}  // namespace limber::server::store
