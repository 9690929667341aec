#pragma once

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/bodies/elastic_body.h"
#include "engine/scene/scene.h"

namespace limber::bench {

using Case =
    nlohmann::ordered_json;  // one flat object per case: keys as the documentation names them

struct SuiteOptions {
  bool quick =
      false;  // finish within 40 s: smaller or fewer cases, fewer repeats; the JSON says so
  std::string
      shared_folder;    // public data; empty: cases that need it are left out and named on stderr
  std::string limberd;  // server binary for the suite `service`; empty: looked for
  int repeats = 5;
};

class Recorder {
 public:
  virtual ~Recorder() = default;
  virtual void add(const Case& result) = 0;        // a row of the table and of --json
  virtual void note(const std::string& text) = 0;  // progress and remarks, on stderr
};

using Suite = void (*)(const SuiteOptions& options, Recorder& recorder);

void spacetime_suite(const SuiteOptions& options, Recorder& recorder);
void material_suite(const SuiteOptions& options, Recorder& recorder);
void material_bodies_suite(const SuiteOptions& options, Recorder& recorder);
void reconstruct_suite(const SuiteOptions& options, Recorder& recorder);
void service_suite(const SuiteOptions& options, Recorder& recorder);
void build_suite(const SuiteOptions& options, Recorder& recorder);
void recovery_suite(const SuiteOptions& options, Recorder& recorder);
void editors_suite(const SuiteOptions& options, Recorder& recorder);
void table1_suite(const SuiteOptions& options, Recorder& recorder);
void cubature_suite(const SuiteOptions& options, Recorder& recorder);
void basis_suite(const SuiteOptions& options, Recorder& recorder);
void cholesky_suite(const SuiteOptions& options, Recorder& recorder);
void linkage_solver_suite(const SuiteOptions& options, Recorder& recorder);
void linkage_suite(const SuiteOptions& options, Recorder& recorder);
void design_suite(const SuiteOptions& options, Recorder& recorder);
void design_ipopt_suite(const SuiteOptions& options, Recorder& recorder);  // where Ipopt is
void rods_suite(const SuiteOptions& options, Recorder& recorder);
void beams_suite(const SuiteOptions& options, Recorder& recorder);
void exact_suite(const SuiteOptions& options, Recorder& recorder);
void modes_suite(const SuiteOptions& options, Recorder& recorder);
void calm_suite(const SuiteOptions& options, Recorder& recorder);
void paths_suite(const SuiteOptions& options, Recorder& recorder);
void beam_edits_suite(const SuiteOptions& options, Recorder& recorder);
void beam_errors_suite(const SuiteOptions& options, Recorder& recorder);
void estimates_suite(const SuiteOptions& options, Recorder& recorder);
// Suites of the report: time against error, growth, and the ratios that scripts/check-ratios
// guards.
void spacetime_error_suite(const SuiteOptions& options, Recorder& recorder);
void material_error_suite(const SuiteOptions& options, Recorder& recorder);
void linkage_error_suite(const SuiteOptions& options, Recorder& recorder);
void design_error_suite(const SuiteOptions& options, Recorder& recorder);
void streams_suite(const SuiteOptions& options, Recorder& recorder);
void growth_bodies_suite(const SuiteOptions& options, Recorder& recorder);
void growth_linkages_suite(const SuiteOptions& options, Recorder& recorder);
void linkage_drag_suite(const SuiteOptions& options, Recorder& recorder);
void growth_beams_suite(const SuiteOptions& options, Recorder& recorder);
void growth_sessions_suite(const SuiteOptions& options, Recorder& recorder);
void growth_subscribers_suite(const SuiteOptions& options, Recorder& recorder);
void web_suite(const SuiteOptions& options, Recorder& recorder);
void ratios_suite(const SuiteOptions& options, Recorder& recorder);
void stability_suite(const SuiteOptions& options, Recorder& recorder);

/// Thrown by a suite at its end, whose cases are complete but not as they must be: they are written
/// all the same, and the program fails.
class Refuted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A named body of the sample scenes or of the public data ("beam", "flower", "dino",
/// "tyrannosaurus", "bunny", "Armadillo13K"); empty if its file is not there. Public bodies come
/// with their fixed nodes and materials; where the data has none (bunny, Armadillo13K) the nodes of
/// the lowest 5 % of the height are fixed.
struct NamedBody {
  std::string name;
  bodies::ElasticBody body;
  std::vector<int> compact_of_source;
};
[[nodiscard]] std::optional<NamedBody> load_body(const std::string& name,
                                                 const SuiteOptions& options);

/// The elastic body of a scene, in SI.
[[nodiscard]] NamedBody body_of_scene(const scene::Scene& scene);

/// Whether $LIMBER_BENCH_ONLY, or one of the parts that commas divide it into, is part of the name;
/// also where it is not set.
[[nodiscard]] inline bool is_selected(const std::string& name) {
  const char* const only = std::getenv("LIMBER_BENCH_ONLY");
  if (only == nullptr) return true;
  const std::string parts = only;
  for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
    end = parts.find(',', begin);
    if (name.find(parts.substr(begin, end - begin)) != std::string::npos) return true;
  }
  return false;
}

/// Milliseconds of one call.
template <typename Work>
[[nodiscard]] double milliseconds(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

[[nodiscard]] inline double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const auto rank = static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank),
                   values.end());
  return values[rank];
}
[[nodiscard]] inline double median(std::vector<double> values) {
  return quantile(std::move(values), 0.5);
}

}  // namespace limber::bench
