#include "bench/report.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "bench/machine.h"

namespace limber::bench {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPython = "/usr/bin/python3";
// For the child that becomes it: the same program, also if a build has replaced the file since.
constexpr const char* kThisProgram = "/proc/self/exe";

enum class Part { kAlways, kWhole };            // of a report: --quick leaves kWhole out
enum class SuiteSize { kQuick, kFull, kSame };  // kSame: --quick where the report is

struct ReportRun {
  const char* id;
  const char* suite;
  SuiteSize size;
  Part part;
  const char* only;  // $LIMBER_BENCH_ONLY of a whole report; empty: all cases
  const char* quick_only = "";
  int repeats = 0;  // 0: as requested
};

// The order is that of the page. Sizes are such that the whole takes less than ten minutes on two
// cores.
constexpr ReportRun kRuns[] = {
    {"reconstruct", "reconstruct", SuiteSize::kQuick, Part::kWhole, ""},
    {"reconstruct_sweep", "reconstruct", SuiteSize::kFull, Part::kAlways, "dino", "dino", 3},
    {"build", "build", SuiteSize::kSame, Part::kAlways, ""},
    {"basis", "basis", SuiteSize::kQuick, Part::kWhole, ""},
    {"cubature", "cubature", SuiteSize::kQuick, Part::kAlways, ""},
    {"editors", "editors", SuiteSize::kSame, Part::kAlways, ""},
    {"exact", "exact", SuiteSize::kQuick, Part::kAlways, "bent by,twisted by,liver,raptor,ditto",
     "bent by,liver", 3},
    {"modes", "modes", SuiteSize::kQuick, Part::kAlways, "bent by,twisted by,liver,raptor",
     "bent by,liver", 3},
    {"spacetime", "spacetime", SuiteSize::kQuick, Part::kAlways, ""},
    {"spacetime_error", "spacetime_error", SuiteSize::kSame, Part::kAlways, ""},
    {"table1", "table1", SuiteSize::kQuick, Part::kWhole, ""},
    {"material", "material", SuiteSize::kQuick, Part::kAlways, "", "", 2},
    {"material_error", "material_error", SuiteSize::kSame, Part::kAlways, ""},
    {"recovery", "recovery", SuiteSize::kQuick, Part::kAlways, ""},
    {"rods", "rods", SuiteSize::kQuick, Part::kAlways, ""},
    {"linkage", "linkage", SuiteSize::kQuick, Part::kAlways, "", "burd", 3},
    {"linkage_drag", "linkage_drag", SuiteSize::kQuick, Part::kWhole, ""},
    {"linkage_solver", "linkage_solver", SuiteSize::kQuick, Part::kAlways, ""},
    {"linkage_error", "linkage_error", SuiteSize::kQuick, Part::kAlways, ""},
    {"design", "design", SuiteSize::kQuick, Part::kWhole, ""},
    {"design_error", "design_error", SuiteSize::kSame, Part::kAlways, ""},
    {"design_ipopt", "design_ipopt", SuiteSize::kQuick, Part::kWhole, "burd"},
    {"beams", "beams", SuiteSize::kQuick, Part::kAlways, ""},
    {"beam_edits", "beam_edits", SuiteSize::kQuick, Part::kWhole, "roof"},
    {"estimates", "estimates", SuiteSize::kQuick, Part::kAlways, ""},
    {"cholesky", "cholesky", SuiteSize::kQuick, Part::kAlways, ""},
    {"streams", "streams", SuiteSize::kSame, Part::kAlways, ""},
    {"service", "service", SuiteSize::kQuick, Part::kAlways, ""},
    {"growth_bodies", "growth_bodies", SuiteSize::kSame, Part::kAlways, "", "", 3},
    {"growth_linkages", "growth_linkages", SuiteSize::kSame, Part::kAlways, "", "", 3},
    {"growth_beams", "growth_beams", SuiteSize::kSame, Part::kAlways, "", "", 3},
    {"growth_sessions", "growth_sessions", SuiteSize::kSame, Part::kAlways, ""},
    {"growth_subscribers", "growth_subscribers", SuiteSize::kQuick, Part::kAlways, ""},
    {"ratios", "ratios", SuiteSize::kQuick, Part::kAlways, ""},
};

struct Variable {
  std::string name, value;  // of the environment; an empty value removes it
};

enum class Output { kShown, kHidden };

struct Ended {
  int status = 0;          // exit code, 128 + the signal that ended it
  double cpu_seconds = 0;  // of the program and the children that it waited for
};

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

Ended run_program(const std::vector<std::string>& command, const Variable& variable,
                  Output output) {
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot start a process");
  if (child == 0) {
    if (output == Output::kHidden) {
      const int nothing = open("/dev/null", O_WRONLY);
      if (nothing >= 0) dup2(nothing, STDOUT_FILENO);
    }
    if (variable.value.empty())
      unsetenv(variable.name.c_str());
    else
      setenv(variable.name.c_str(), variable.value.c_str(), 1);
    std::vector<char*> argv;
    argv.reserve(command.size() + 1);
    for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    execv(argv[0], argv.data());
    _exit(127);
  }
  int status = 0;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime)};
}

const Variable kOnly{"LIMBER_BENCH_ONLY", ""};

Case run_suite(const ReportRun& run, const SuiteOptions& options, const fs::path& raw) {
  std::vector<std::string> command{kThisProgram, run.suite, "--json",
                                   (raw / (std::string(run.id) + ".json")).string()};
  const bool is_quick =
      run.size == SuiteSize::kQuick || (run.size == SuiteSize::kSame && options.quick);
  if (is_quick) command.push_back("--quick");
  const int repeats = run.repeats > 0 ? std::min(run.repeats, options.repeats) : options.repeats;
  for (const std::string& word : {std::string("--repeats"), std::to_string(repeats)})
    command.push_back(word);
  if (!options.shared_folder.empty()) {
    command.push_back("--shared");
    command.push_back(options.shared_folder);
  }
  if (!options.limberd.empty()) {
    command.push_back("--limberd");
    command.push_back(options.limberd);
  }
  const char* const only = options.quick && *run.quick_only != 0 ? run.quick_only : run.only;
  Case entry;
  entry["id"] = run.id;
  entry["suite"] = run.suite;
  entry["quick"] = is_quick;
  entry["repeats"] = repeats;
  entry["only"] = only;
  Ended ended;
  entry["seconds"] = 1e-3 * milliseconds([&] {
                       ended = run_program(command, {kOnly.name, only}, Output::kHidden);
                     });
  entry["cpu_seconds"] = ended.cpu_seconds;
  entry["status"] = ended.status;
  return entry;
}

/// Files of an earlier report, and nothing else that may be in a folder.
void remove_files(const fs::path& folder, const std::string& ending) {
  if (!fs::is_directory(folder)) return;
  std::vector<fs::path> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && entry.path().extension() == ending) found.push_back(entry);
  for (const fs::path& path : found) fs::remove(path);
}

}  // namespace

int make_report(const SuiteOptions& options, const fs::path& folder,
                const std::vector<std::string>& suites, Recorder& recorder) {
  const std::string script = source_folder() + "/bench/report/make_page.py";
  if (run_program({kPython, script, "--check"}, kOnly, Output::kShown).status != 0)
    throw std::runtime_error("the page cannot be drawn here, see above; nothing was measured");
  const fs::path raw = folder / "raw";
  remove_files(raw, ".json");
  remove_files(folder / "plots", ".svg");
  fs::create_directories(raw);
  Case report;
  report["quick"] = options.quick;
  report["has_public_data"] = !options.shared_folder.empty();
  report["machine"] = describe_machine();
  report["commit"] = source_commit();
  report["load_before"] = load_average();
  report["runs"] = Case::array();
  int failed = 0;
  double seconds = 0, cpu_seconds = 0;
  for (const ReportRun& run : kRuns) {
    if (std::find(suites.begin(), suites.end(), run.suite) == suites.end()) continue;
    if (options.quick && run.part == Part::kWhole) continue;
    recorder.note(fmt::format("report: {} ({:.0f} s so far)", run.id, seconds));
    report["runs"].push_back(run_suite(run, options, raw));
    const Case& entry = report["runs"].back();
    seconds += entry["seconds"].get<double>();
    cpu_seconds += entry["cpu_seconds"].get<double>();
    if (entry["status"] != 0) ++failed;
  }
  report["load_after"] = load_average();
  report["seconds"] = seconds;
  report["cpu_seconds"] = cpu_seconds;
  std::ofstream file(raw / "report.json");
  file << report.dump(2) << "\n";
  file.close();
  if (!file) throw std::runtime_error("cannot write " + (raw / "report.json").string());
  if (failed > 0) recorder.note(fmt::format("report: {} suites failed", failed));
  const int drawn = run_program({kPython, script, folder.string()}, kOnly, Output::kShown).status;
  return failed > 0 || drawn != 0 ? 1 : 0;
}

}  // namespace limber::bench
