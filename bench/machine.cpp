#include "bench/machine.h"

#include <sched.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

namespace limber::bench {
namespace {

std::string cpu_model() {
  std::ifstream cpuinfo("/proc/cpuinfo");
  std::string line;
  while (std::getline(cpuinfo, line)) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

int usable_cores() {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) == 0) return CPU_COUNT(&set);
  return static_cast<int>(std::thread::hardware_concurrency());
}

constexpr const char* simd_level() {
#if defined(__AVX512F__)
  return "x86-64-v4";
#elif defined(__AVX2__) && defined(__FMA__)
  return "x86-64-v3";
#elif defined(__SSE4_2__)
  return "x86-64-v2";
#elif defined(__x86_64__)
  return "x86-64";
#else
  return "other";
#endif
}

}  // namespace

Case describe_machine() {
  Case machine;
  machine["cpu"] = cpu_model();
  machine["cores"] = usable_cores();
  machine["simd"] = simd_level();
  machine["compiler"] = "g++ " __VERSION__;
  machine["build_type"] = LIMBER_BUILD_TYPE;
  return machine;
}

Case load_average() {
  std::array<double, 1> load{};
  if (getloadavg(load.data(), 1) != 1) return nullptr;
  return load[0];
}

std::string source_folder() { return LIMBER_SOURCE_DIR; }

std::string source_commit() {
  const std::string command =
      "git -C '" + source_folder() + "' describe --always --dirty --abbrev=12 2>/dev/null";
  std::string commit;
  if (FILE* const pipe = popen(command.c_str(), "r")) {
    std::array<char, 128> buffer{};
    while (fgets(buffer.data(), buffer.size(), pipe) != nullptr) commit += buffer.data();
    pclose(pipe);
  }
  while (!commit.empty() && commit.back() == '\n') commit.pop_back();
  return commit.empty() ? "unknown" : commit;
}

}  // namespace limber::bench
