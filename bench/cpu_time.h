#pragma once

#include <sys/resource.h>

#include <ctime>

namespace limber::bench {

/// CPU time of all threads of the process [s], without that of other processes on the machine.
[[nodiscard]] inline double process_cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// User CPU time of the process [s]: other processes on the machine do not change it much.
[[nodiscard]] inline double user_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

/// CPU seconds of one call.
template <typename Work>
[[nodiscard]] double cpu_seconds(Work&& work) {
  const double start = process_cpu_seconds();
  work();
  return process_cpu_seconds() - start;
}

}  // namespace limber::bench
