#include "server/store/counted_syncs.h"

#include <sqlite3.h>

#include <atomic>
#include <chrono>
#include <new>

namespace limber::server::store {
namespace {

std::atomic<std::uint64_t> syncs{0}, sync_ns{0};

/// SQLite allocates these, with the file of the real VFS right behind.
struct File {
  sqlite3_file base;  // first: SQLite takes it for the whole
  sqlite3_file* real;
};

sqlite3_file* real_of(sqlite3_file* file) { return reinterpret_cast<File*>(file)->real; }

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
      pass_on<&M::xShmMap, int, int, int, void volatile**>,
      pass_on<&M::xShmLock, int, int, int>,
      shm_barrier,
      pass_on<&M::xShmUnmap, int>,
      pass_on<&M::xFetch, sqlite3_int64, int, void**>,
      pass_on<&M::xUnfetch, sqlite3_int64, void*>,
  };
}
/// Of files with all of these, as those of Unix are, and without what came after the first version.
const sqlite3_io_methods kMethods = methods(3), kFirstMethods = methods(1);

int open_file(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out_flags) {
  auto* const real_vfs = static_cast<sqlite3_vfs*>(vfs->pAppData);
  auto* const own = ::new (file) File{};
  own->real = reinterpret_cast<sqlite3_file*>(own + 1);
  const int code = real_vfs->xOpen(real_vfs, name, own->real, flags, out_flags);
  // SQLite closes what has methods, whether or not it could be opened.
  if (const auto* real = own->real->pMethods)
    own->base.pMethods = real->iVersion >= 3 ? &kMethods : &kFirstMethods;
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

const char* counting_vfs() {
  static const char* const name = make_vfs();
  return name;
}

}  // namespace limber::server::store
