// What a first visit costs: a model built to a mean error of 1 % on held-out poses, from a mesh in
// memory.
#include <fmt/core.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <stdexcept>

#include "bench/bar_body.h"
#include "bench/cpu_time.h"
#include "bench/suite.h"
#include "engine/reduced/reduced_model.h"

namespace limber::bench {
namespace {

constexpr const char* kBar = "bar";  // bar_body.h, 88,434 tets
constexpr int kBarCells = 17;

std::optional<NamedBody> load(const std::string& name, const SuiteOptions& options) {
  if (name == kBar) return NamedBody{name, bar_body(kBarCells), {}};
  return load_body(name, options);
}

struct BuildCost {
  double build_s = 0, cpu_s = 0, peak_mb = 0, error_mean = 0, error_max = 0, modes_s = 0,
         poses_s = 0, basis_s = 0, cubature_s = 0;
  int tets = 0, basis = 0, cubature_tets = 0, met_tolerance = 0;
};

BuildCost build_here(const std::string& name, const SuiteOptions& options) {
  const auto named = load(name, options);
  if (!named) throw std::runtime_error("no body " + name);
  reduced::ReducedModel model;
  BuildCost built;
  const double cpu = process_cpu_seconds();
  built.build_s = 1e-3 * milliseconds([&] { model = reduced::build_model(named->body, {}); });
  built.cpu_s = process_cpu_seconds() - cpu;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  built.peak_mb = static_cast<double>(usage.ru_maxrss) / 1024;
  built.tets = named->body.mesh.tet_count();
  built.basis = model.basis_size();
  built.cubature_tets = model.cubature_size();
  built.error_mean = model.report.error_mean;
  built.error_max = model.report.error_max;
  built.met_tolerance = model.report.met_tolerance ? 1 : 0;
  built.modes_s = model.report.modes_s;
  built.poses_s = model.report.poses_s;
  built.basis_s = model.report.basis_s;
  built.cubature_s = model.report.cubature_s;
  return built;
}

/// In a process of its own, so that the peak of memory is this build's.
BuildCost build_aside(const std::string& name, const SuiteOptions& options) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("pipe failed");
  const pid_t child = fork();
  if (child == 0) {
    BuildCost built;
    try {
      built = build_here(name, options);
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}\n", error.what());
      _exit(1);
    }
    const bool written = write(ends[1], &built, sizeof built) == static_cast<ssize_t>(sizeof built);
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  BuildCost built;
  const bool whole = read(ends[0], &built, sizeof built) == static_cast<ssize_t>(sizeof built);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!whole || status != 0) throw std::runtime_error("building " + name + " failed");
  return built;
}

}  // namespace

void build_suite(const SuiteOptions& options, Recorder& recorder) {
  for (const std::string name : {"beam", "dino", "bunny", "Armadillo13K", "beam-fine", kBar}) {
    if (options.quick && name != "beam" && name != "dino") {
      recorder.note(fmt::format("build: {} left out by --quick", name));
      continue;
    }
    if (!load(name, options)) {
      recorder.note(fmt::format("build: no {} (public data not found)", name));
      continue;
    }
    recorder.note(fmt::format("build: {}", name));
    const BuildCost built = build_aside(name, options);
    Case result;
    result["scene"] = name;
    result["tets"] = built.tets;
    result["build_s"] = built.build_s;
    result["cpu_s"] = built.cpu_s;
    result["peak_mb"] = built.peak_mb;
    result["basis"] = built.basis;
    result["cubature_tets"] = built.cubature_tets;
    result["error_mean"] = built.error_mean;
    result["error_max"] = built.error_max;
    result["met_tolerance"] = built.met_tolerance == 1;
    result["modes_s"] = built.modes_s;
    result["poses_s"] = built.poses_s;
    result["basis_s"] = built.basis_s;
    result["cubature_s"] = built.cubature_s;
    recorder.add(result);
  }
}

}  // namespace limber::bench
