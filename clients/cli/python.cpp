#include "clients/cli/python.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "clients/cpp/error.h"

namespace limber::cli {
namespace {

namespace fs = std::filesystem;
using client::ClientError;

/// @returns empty where it is not set
std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

void use_own_python() {
  std::error_code failed;
  const fs::path own =
      fs::weakly_canonical(fs::path(own_folder()) / "../../../clients/python", failed);
  if (failed || !fs::exists(own / "limber" / "__main__.py", failed)) return;
  const std::string before = variable("PYTHONPATH");
  setenv("PYTHONPATH", (before.empty() ? own.string() : own.string() + ":" + before).c_str(), 1);
}

/// Modules of Debian's packages belong to its own Python, whichever comes first on the path.
std::string interpreter() {
  if (std::string given = variable("LIMBER_PYTHON"); !given.empty()) return given;
  constexpr const char* kOfDebian = "/usr/bin/python3";
  const bool is_of_path = !variable("VIRTUAL_ENV").empty() || access(kOfDebian, X_OK) != 0;
  return is_of_path ? "python3" : kOfDebian;
}

}  // namespace

void demand_no_keys(const Context& context, const std::string& command) {
  if (context.server_key.empty() && context.key_file.empty()) return;
  throw ClientError(
      v1::ERROR_CODE_UNSUPPORTED, "key_file",
      fmt::format("{} does not take CURVE keys; the Python client does, with limber.connect(keys)",
                  command));
}

void run_python(const Context& context, const std::string& command,
                std::vector<std::string> arguments) {
  const std::string python = interpreter();
  std::vector<std::string> words = {python,           "-m",   "limber", "--endpoint",
                                    context.endpoint, command};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  use_own_python();
  std::fflush(nullptr);
  execvp(argv[0], argv.data());
  throw ClientError(v1::ERROR_CODE_NOT_FOUND, "LIMBER_PYTHON",
                    fmt::format("{} needs Python and the Python client of limber: {}: {}", command,
                                python, std::strerror(errno)));
}

}  // namespace limber::cli
