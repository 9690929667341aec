#pragma once

#include <cstdint>

namespace limber::server {

/// What this process takes of the machine, as the operating system tells it. 0: it does not.
struct ProcessUse {
  std::uint64_t resident_bytes = 0;
  double cpu_s = 0;  // of all threads
  std::uint32_t open_files = 0;
  std::uint64_t most_open_files = 0;
  std::uint32_t threads = 0;

  [[nodiscard]] static ProcessUse now();
};

}  // namespace limber::server
