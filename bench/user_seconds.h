#pragma once

#include <sys/resource.h>

namespace limber::bench {

/// User CPU time of the process [s]: other processes on the machine do not change it much.
[[nodiscard]] inline double user_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

}  // namespace limber::bench
