#pragma once

#include <cstdint>

namespace limber::server {

/// Resources that this process uses, as the operating system reports them. 0: not reported.
struct ProcessUse {
  std::uint64_t resident_bytes = 0;
  double cpu_s = 0;  // of all threads
  std::uint32_t open_files = 0;
  std::uint64_t most_open_files = 0;
  std::uint32_t threads = 0;

  [[nodiscard]] static ProcessUse now();
};

}  // namespace limber::server
