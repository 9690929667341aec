#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>

#include "bench/machine.h"
#include "bench/report.h"
#include "bench/suite.h"
#include "bench/table.h"

namespace {

using limber::bench::Case;

/// Columns are as wide as their widest cell: the table comes at the end, progress until then is
/// printed on stderr.
class Collector final : public limber::bench::Recorder {
 public:
  void add(const Case& result) override { cases_.push_back(result); }
  void note(const std::string& text) override { fmt::print(stderr, "{}\n", text); }
  [[nodiscard]] const std::vector<Case>& cases() const { return cases_; }

 private:
  std::vector<Case> cases_;
};

void write_json(const std::string& path, const std::string& suite, bool quick,
                const std::vector<Case>& cases) {
  Case document;
  document["suite"] = suite;
  document["quick"] = quick;
  document["machine"] = limber::bench::describe_machine();
  document["load"] = limber::bench::load_average();
  document["cases"] = cases;
  std::ofstream file(path);
  file << document.dump(2) << "\n";
  if (!file) throw std::runtime_error("cannot write " + path);
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string, limber::bench::Suite> suites = {
#ifdef LIMBER_BENCH_SUITES
      LIMBER_BENCH_SUITES
#endif
  };
  CLI::App app{
      "Measures limber: prints a table of its cases; --json writes them for machines. The suite\n"
      "`report` runs all that a report of minutes needs and writes a page with plots.\n"
      "Times are medians of repeated calls within one run; machines differ, so compare ratios."};
  std::string suite;
  std::string json;
  limber::bench::SuiteOptions options;
  if (const char* shared = std::getenv("LIMBER_SHARED")) options.shared_folder = shared;
  std::string names;
  for (const auto& [name, unused] : suites) names += (names.empty() ? "" : ", ") + name;
  std::string out = "docs/report";
  app.add_option("suite", suite, "One of: report, " + names)->required();
  app.add_option("--json", json, "Also write {\"machine\": ..., \"cases\": [...]} to this file");
  app.add_flag(
      "--quick", options.quick,
      "Finish within 40 s: fewer or smaller cases (the omitted ones are listed on stderr);\n"
      "a report within 4 minutes");
  app.add_option("--out", out, "Folder that `report` writes to (default: docs/report)");
  app.add_option("--repeats", options.repeats, "Runs of each timed piece of work")
      ->check(CLI::Range(1, 1000));
  app.add_option("--shared", options.shared_folder,
                 "Folder with the public data (default: $LIMBER_SHARED or ../shared)");
  app.add_option(
      "--limberd", options.limberd,
      "Server binary for the suite `service` (default: beside this program, else on PATH)");
  CLI11_PARSE(app, argc, argv);
  if (options.shared_folder.empty() && std::filesystem::exists("../shared/data"))
    options.shared_folder = "../shared";
  Collector recorder;
  if (suite == "report") {
    try {
      std::vector<std::string> available;
      available.reserve(suites.size());
      for (const auto& [name, unused] : suites) available.push_back(name);
      return limber::bench::make_report(options, out, available, recorder);
    } catch (const std::exception& error) {
      fmt::print(stderr, "limber-bench: {}\n", error.what());
      return 1;
    }
  }
  const auto found = suites.find(suite);
  if (found == suites.end()) {
    fmt::print(stderr, "limber-bench: no suite \"{}\"; there are: report, {}\n", suite, names);
    return 2;
  }
  int status = 0;
  bool is_complete = true;
  try {
    found->second(options, recorder);
  } catch (const limber::bench::Refuted& refuted) {
    fmt::print(stderr, "limber-bench: {}\n", refuted.what());
    status = 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "limber-bench: {}\n", error.what());
    status = 1;
    is_complete = false;
  }
  // Measurements before a failure are shown, but no file is left that looks whole.
  fmt::print("{}", limber::bench::table_of(recorder.cases()));
  if (!is_complete || json.empty()) return status;
  try {
    write_json(json, suite, options.quick, recorder.cases());
  } catch (const std::exception& error) {
    fmt::print(stderr, "limber-bench: {}\n", error.what());
    return 1;
  }
  return status;
}
