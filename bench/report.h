#pragma once

#include <filesystem>
#include <string>

#include "bench/suite.h"

namespace limber::bench {

/// Runs the suites of the report one after the other, and draws the page
/// (bench/report/make_page.py). Each is a process of its own with the sizes that suit a report of
/// minutes.
///
/// Writes to `folder`: raw/ID.json, the output of each suite; raw/report.json; index.html,
/// README.md and plots/*.svg. In report.json are the machine, the commit, the load before and
/// after, and of each run its suite, arguments, seconds, CPU seconds and exit code. Earlier
/// raw/*.json and plots/*.svg are removed. The page reports suites that failed.
/// @param suites  names that there are: runs of others are left out
/// @returns the program's exit code: 0, or 1 where a suite or the page failed
/// @throws std::runtime_error where the page cannot be drawn here (no Python with matplotlib),
/// before anything runs, or files cannot be written
int make_report(const SuiteOptions& options, const std::filesystem::path& folder,
                const std::vector<std::string>& suites, Recorder& recorder);

}  // namespace limber::bench
