// The page in a browser: bench/web.mjs, run by node.
#include <fmt/format.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "bench/find_program.h"
#include "bench/suite.h"

namespace limber::bench {
namespace {

namespace fs = std::filesystem;

/// Properties of the machine that every suite reports already.
constexpr std::array kOfTheMachine{"suite",      "date",        "processor",
                                   "processors", "load_before", "load_after"};

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

std::string find_node() {
  try {
    return find_program("node", "");
  } catch (const std::runtime_error&) {
    throw std::runtime_error("the suite web needs node on PATH: install the package nodejs");
  }
}

fs::path find_script() {
  const fs::path source = LIMBER_SOURCE_DIR;
  fs::path script = source / "bench" / "web.mjs";
  if (!fs::exists(script))
    throw std::runtime_error(
        fmt::format("the suite web needs the source tree that this program was built from: no {}",
                    script.string()));
  for (const char* const needed : {"clients/web/node_modules", "clients/web/dist/main.js"}) {
    if (!fs::exists(source / needed))
      throw std::runtime_error(
          fmt::format("the suite web needs {}: scripts/build-web makes it (with the npm registry)",
                      (source / needed).string()));
  }
  return script;
}

/// Output of the command on stdout. @throws std::runtime_error if it fails
std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"),
                                                   [](FILE* file) { return pclose(file); });
  if (!pipe) throw std::runtime_error("cannot run " + command);
  std::string output;
  std::array<char, 4096> part{};
  while (const std::size_t read = fread(part.data(), 1, part.size(), pipe.get()))
    output.append(part.data(), read);
  return output;
}

/// One flat object: members of members get both names.
void flatten(const Case& from, const std::string& prefix, Case& to) {
  for (const auto& [name, value] : from.items()) {
    const std::string key = prefix.empty() ? name : fmt::format("{}_{}", prefix, name);
    if (value.is_object()) {
      flatten(value, key, to);
    } else {
      to[key] = value;
    }
  }
}

}  // namespace

void web_suite(const SuiteOptions& options, Recorder& recorder) {
  const std::string node = find_node();
  const fs::path script = find_script();
  const fs::path limberd = find_program("limberd", options.limberd);
  if (limberd.filename() != "limberd")
    throw std::runtime_error(
        fmt::format("--limberd: the suite web takes a program named limberd, not {}",
                    limberd.filename().string()));
  const char* const fewer = options.quick ? " --moves 20 --pages 2 --sleep 5" : "";
  if (options.quick) recorder.note("web: 20 movements, 2 pages, 5 s asleep (of 60, 8, 60 s)");
  const int repeats = options.quick ? std::min(options.repeats, 2) : options.repeats;
  const std::string printed = output_of(
      fmt::format("LIMBER_BIN={} {} {} --repeats {}{}", quoted(limberd.parent_path().string()),
                  quoted(node), quoted(script.string()), repeats, fewer));
  const Case measured = Case::parse(printed, nullptr, /*allow_exceptions=*/false);
  if (!measured.is_object())
    throw std::runtime_error("bench/web.mjs has ended without a result: see what it said above");
  Case row;
  flatten(measured, "", row);
  for (const char* const key : kOfTheMachine) row.erase(key);
  recorder.add(row);
}

}  // namespace limber::bench
