#include "bench/find_program.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <stdexcept>

namespace limber::bench {
namespace {

namespace fs = std::filesystem;

bool is_program(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && access(path.c_str(), X_OK) == 0;
}

}  // namespace

std::string find_program(const std::string& name, const std::string& given) {
  if (!given.empty()) {
    if (is_program(given)) return given;
    throw std::runtime_error(fmt::format("--{}: {} is no program", name, given));
  }
  // argv[0] has no folder where the shell found this program on PATH.
  std::error_code failed;
  const fs::path self = fs::read_symlink("/proc/self/exe", failed);
  const fs::path folder = failed ? fs::path(".") : self.parent_path();
  if (is_program(folder / name)) return (folder / name).string();
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string other; std::getline(folders, other, ':');) {
    const fs::path candidate = fs::path(other.empty() ? "." : other) / name;
    if (is_program(candidate)) return candidate.string();
  }
  throw std::runtime_error(fmt::format(
      "no {} beside this program ({}) or on PATH; scripts/build makes it, --{} names it", name,
      folder.string(), name));
}

}  // namespace limber::bench
