#include "server/store/store_vfs.h"

#include <sqlite3.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <new>

namespace limber::server::store {
namespace {

std::atomic<std::uint64_t> syncs{0}, sync_ns{0};

/// SQLite allocates these, with the file of the real VFS right behind.
struct File {
  sqlite3_file base;  // first: SQLite takes it for the whole
  sqlite3_file* real;
  const volatile void* index;  // the first part of the log's index, where it is mapped
};

File& own(sqlite3_file* file) { return *reinterpret_cast<File*>(file); }
sqlite3_file* real_of(sqlite3_file* file) { return own(file).real; }

/// A method that passes everything on to that of the real file.
template <auto kMethod, class... Args>
int pass_on(sqlite3_file* file, Args... args) {
  sqlite3_file* const real = real_of(file);
  return (real->pMethods->*kMethod)(real, args...);
}

int close_file(sqlite3_file* file) {
  const int code = pass_on<&sqlite3_io_methods::xClose>(file);
  file->pMethods = nullptr;
  return code;
}

int sync_file(sqlite3_file* file, int flags) {
  const auto begin = std::chrono::steady_clock::now();
  const int code = pass_on<&sqlite3_io_methods::xSync, int>(file, flags);
  const std::chrono::nanoseconds took = std::chrono::steady_clock::now() - begin;
  syncs.fetch_add(1, std::memory_order_relaxed);
  sync_ns.fetch_add(static_cast<std::uint64_t>(took.count()), std::memory_order_relaxed);
  return code;
}

int shm_map(sqlite3_file* file, int region, int bytes, int extends, void volatile** out) {
  const int code = pass_on<&sqlite3_io_methods::xShmMap, int, int, int, void volatile**>(
      file, region, bytes, extends, out);
  if (region == 0 && code == SQLITE_OK) own(file).index = *out;
  return code;
}

int shm_unmap(sqlite3_file* file, int removes) {
  own(file).index = nullptr;
  return pass_on<&sqlite3_io_methods::xShmUnmap, int>(file, removes);
}

void shm_barrier(sqlite3_file* file) {
  sqlite3_file* const real = real_of(file);
  real->pMethods->xShmBarrier(real);
}

using M = sqlite3_io_methods;
constexpr sqlite3_io_methods methods(int version) {
  return {
      version,
      close_file,
      pass_on<&M::xRead, void*, int, sqlite3_int64>,
      pass_on<&M::xWrite, const void*, int, sqlite3_int64>,
      pass_on<&M::xTruncate, sqlite3_int64>,
      sync_file,
      pass_on<&M::xFileSize, sqlite3_int64*>,
      pass_on<&M::xLock, int>,
      pass_on<&M::xUnlock, int>,
      pass_on<&M::xCheckReservedLock, int*>,
      pass_on<&M::xFileControl, int, void*>,
      pass_on<&M::xSectorSize>,
      pass_on<&M::xDeviceCharacteristics>,
      shm_map,
      pass_on<&M::xShmLock, int, int, int>,
      shm_barrier,
      shm_unmap,
      pass_on<&M::xFetch, sqlite3_int64, int, void**>,
      pass_on<&M::xUnfetch, sqlite3_int64, void*>,
  };
}
/// For files with all of these, like those of Unix, and without additions after the first version.
const sqlite3_io_methods kMethods = methods(3), kFirstMethods = methods(1);

int open_file(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  auto* const real_vfs = static_cast<sqlite3_vfs*>(vfs->pAppData);
  auto* const made = ::new (file) File{};
  made->real = reinterpret_cast<sqlite3_file*>(made + 1);
  const int code = real_vfs->xOpen(real_vfs, name, made->real, flags, out_flags);
  // SQLite closes a file that has methods, whether or not it could be opened.
  if (const auto* real = made->real->pMethods)
    made->base.pMethods = real->iVersion >= 3 ? &kMethods : &kFirstMethods;
  return code;
}

/// @returns null where the default VFS has not all the methods
const char* make_vfs() {
  static sqlite3_vfs vfs;
  sqlite3_vfs* const real = ::sqlite3_vfs_find(nullptr);
  if (real == nullptr || real->iVersion < 3) return nullptr;
  vfs = *real;  // calls without a file take the VFS only for its name and settings
  vfs.pNext = nullptr;
  vfs.zName = "limber";
  vfs.pAppData = real;
  vfs.szOsFile = static_cast<int>(sizeof(File)) + real->szOsFile;
  vfs.xOpen = open_file;
  return ::sqlite3_vfs_register(&vfs, 0) == SQLITE_OK ? vfs.zName : nullptr;
}

}  // namespace

Syncs Syncs::now() { return {syncs.load(), static_cast<double>(sync_ns.load()) * 1e-9}; }

const char* store_vfs() {
  static const char* const name = make_vfs();
  return name;
}

std::uint64_t LogIndex::bytes() const {
  constexpr std::uint64_t kHeader = 32, kFrameHeader = 24;
  return frames == 0 ? 0 : kHeader + frames * (kFrameHeader + page_bytes);
}

std::optional<LogIndex> log_index(sqlite3* connection) {
  constexpr std::size_t kPageBytes = 14, kFrames = 16, kFolded = 96;
  sqlite3_file* file = nullptr;
  const int code = ::sqlite3_file_control(connection, "main", SQLITE_FCNTL_FILE_POINTER, &file);
  if (code != SQLITE_OK || file == nullptr || file->pMethods != &kMethods) return std::nullopt;
  const auto* const index = static_cast<const volatile unsigned char*>(own(file).index);
  if (index == nullptr) return std::nullopt;
  const auto number = [index]<class T>(std::size_t offset, T value) -> T {
    unsigned char bytes[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes[i] = index[offset + i];
    std::memcpy(&value, bytes, sizeof(T));
    return value;
  };
  const std::uint64_t page = number(kPageBytes, std::uint16_t{});
  LogIndex out{number(kFrames, std::uint32_t{}), number(kFolded, std::uint32_t{}),
               page == 1 ? 65536 : page};
  out.folded = std::min(out.folded, out.frames);  // the log may begin anew meanwhile
  return out;
}

}  // namespace limber::server::store
