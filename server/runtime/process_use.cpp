#include "server/runtime/process_use.h"

#include <sys/resource.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace limber::server {
namespace {

std::uint32_t entries_of(const char* folder) {
  std::error_code fault;
  std::uint32_t entries = 0;
  for (auto it = std::filesystem::directory_iterator(folder, fault);
       !fault && it != std::filesystem::directory_iterator(); it.increment(fault))
    ++entries;
  return entries;
}

}  // namespace

ProcessUse ProcessUse::now() {
  ProcessUse use;
  std::uint64_t pages = 0, resident_pages = 0;
  if (std::ifstream("/proc/self/statm") >> pages >> resident_pages)
    use.resident_bytes = resident_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  timespec time{};
  if (::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time) == 0)
    use.cpu_s = static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
  use.open_files = entries_of("/proc/self/fd");
  if (use.open_files > 0) --use.open_files;  // the one that lists them
  use.threads = entries_of("/proc/self/task");
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0) use.most_open_files = limit.rlim_cur;
  return use;
}

}  // namespace limber::server
