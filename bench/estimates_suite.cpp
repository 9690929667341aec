// Are estimates of discretisation errors within a factor of 3 of the truth? The problems are rods
// in linkages and beams with known answers, domes and burd deployed, with 3 to 40 edges or
// elements. Estimates are those of sessions. The truth is the distance and the energy next to the
// same equilibrium with edges or elements an eighth (beams: a sixteenth) as long. `ratio`: estimate
// over truth; errors that are rounding are left out. The last row of each kind, `case` "all": how
// many errors there are and which share of them is within a factor of 3, and the least and largest
// ratio.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "bench/beam_truth.h"
#include "bench/dome_lines.h"
#include "bench/linkage_models.h"
#include "bench/suite.h"
#include "engine/base/degrees.h"
#include "engine/rods/equilibrium/deployment.h"
#include "engine/rods/linkage/drawn_extent.h"
#include "engine/scene/formats/line_formats.h"
#include "tests/support/solved_linkages.h"

namespace limber::bench {
namespace {

using rods::BendingForm;
using rods::testing::SolvedLinkage;

constexpr double kFactor = 3;
// Shares of the size and of the energy: equilibria are balanced to 1e-8.
constexpr double kRoundingOfPositions = 1e-8, kRoundingOfEnergies = 1e-7;

/// The ratios of one kind.
class Ratios {
 public:
  Ratios(const char* kind, Recorder& recorder) : kind_(kind), recorder_(recorder) {}

  void add(const std::string& name, const char* form, int edges, double estimate, double truth,
           double energy_estimate, double energy_truth) {
    Case row = row_of(name);
    row["form"] = form;
    row["edges"] = edges;
    row["estimate"] = estimate;
    row["true"] = truth;
    row["ratio"] = ratio(estimate, truth, kRoundingOfPositions);
    row["energy_estimate"] = energy_estimate;
    row["energy_true"] = energy_truth;
    row["energy_ratio"] = ratio(energy_estimate, energy_truth, kRoundingOfEnergies);
    recorder_.add(row);
  }
  /// An equilibrium without an estimate, or without a truth: counts as wrong.
  void add_unknown(const std::string& name, const char* form, int edges) {
    Case row = row_of(name);
    row["form"] = form;
    row["edges"] = edges;
    for (const char* key :
         {"estimate", "true", "ratio", "energy_estimate", "energy_true", "energy_ratio"})
      row[key] = nullptr;
    ++unknown_;
    recorder_.add(row);
  }
  void finish() {
    Case row = row_of("all");
    const auto within = std::count_if(ratios_.begin(), ratios_.end(), [](double value) {
      return value >= 1 / kFactor && value <= kFactor;
    });
    const auto count = ratios_.size() + static_cast<std::size_t>(unknown_);
    row["errors"] = count;
    row["within_3"] =
        static_cast<double>(within) / static_cast<double>(std::max<std::size_t>(1, count));
    row["least_ratio"] = ratios_.empty() ? 0 : *std::min_element(ratios_.begin(), ratios_.end());
    row["largest_ratio"] = ratios_.empty() ? 0 : *std::max_element(ratios_.begin(), ratios_.end());
    recorder_.add(row);
  }

 private:
  [[nodiscard]] Case row_of(const std::string& name) const {
    Case row;
    row["kind"] = kind_;
    row["case"] = name;
    return row;
  }
  [[nodiscard]] Case ratio(double estimate, double truth, double rounding) {
    if (!(truth > rounding)) return nullptr;
    ratios_.push_back(estimate / truth);
    return ratios_.back();
  }

  const char* kind_;
  Recorder& recorder_;
  std::vector<double> ratios_;
  int unknown_ = 0;
};

void add_linkage(const std::string& name, BendingForm form, int edges, const SolvedLinkage& given,
                 Ratios& ratios) {
  const char* const form_name =
      form == BendingForm::kTurningAngle ? "turning angle" : "material frames";
  const rods::DiscretisationError estimate = rods::testing::estimate_of(given);
  const auto truth = rods::testing::true_error(given);
  if (!given.is_found || !estimate.is_known() || !truth)
    return ratios.add_unknown(name, form_name, edges);
  const double size = rods::drawn_extent(given.model.graph());
  ratios.add(name, form_name, edges, estimate.max_distance / size, truth->distance / size,
             estimate.energy_error, truth->energy);
}

SolvedLinkage opened_dome(int edges, BendingForm form) {
  rods::LinkageModel model(rods::build_linkage_graph(dome_lines(5)), edges,
                           {1.25e6, 2.6, 10.4, 2.9}, form);
  rods::Conditions conditions;
  conditions.pins = {{model.variables().joints() / 2}};
  conditions.mean_opening_angle = rods::LinkageState(model).mean_opening_angle() + 10 * kDegree;
  return rods::testing::solved_linkage(std::move(model), conditions);
}

SolvedLinkage deployed(const LinkageCase& named, const rods::LinkageGraph& graph, int edges,
                       BendingForm form) {
  rods::LinkageModel model(graph, edges, named.stiffness, form);
  rods::Conditions conditions;
  conditions.pins = {{named.held}};
  SolvedLinkage given = rods::testing::solved_linkage(std::move(model), conditions);
  given.conditions.mean_opening_angle = named.target * kDegree;
  rods::DeploymentOptions options;
  options.first_step = options.largest_step = 1.0 / named.steps;
  rods::LinkageEquilibrium equilibrium(given.model);
  given.is_found =
      rods::deploy(equilibrium, given.state, given.conditions, options).end.converged();
  return given;
}

void run_linkages(const SuiteOptions& options, Recorder& recorder) {
  Ratios ratios("linkages", recorder);
  const LinkageCase& burd = linkage_case("burd");
  const auto path = find_linkage_lines(options, burd.name, burd.file, recorder);
  for (const BendingForm form : {BendingForm::kTurningAngle, BendingForm::kMaterialFrames}) {
    for (const int edges : {3, 5, 10, 20, 40}) {
      for (const double alpha : {1.0, 10.0}) {
        add_linkage(fmt::format("cantilever, alpha {}", alpha), form, edges,
                    rods::testing::cantilever_linkage(edges, alpha, form), ratios);
      }
      add_linkage("ring", form, edges, rods::testing::ring_linkage(edges, form), ratios);
      if (edges >= 10) {
        add_linkage("elastica, span .3", form, edges, rods::testing::elastica_linkage(edges, form),
                    ratios);
      }
      if (edges > 20) continue;
      add_linkage("dome", form, edges, opened_dome(edges, form), ratios);
      if (path && edges >= 5) {
        const auto graph = rods::build_linkage_graph(scene::read_line_mesh_file(*path));
        add_linkage("burd", form, edges, deployed(burd, graph, edges, form), ratios);
      }
    }
  }
  ratios.finish();
}

void run_beams(Recorder& recorder) {
  Ratios ratios("beams", recorder);
  for (const KnownStructure& known : known_structures()) {
    for (const int elements : {3, 5, 10, 20, 40}) {
      const beams::BeamModel model = known.make(elements);
      const beams::BeamSolution solution = find_equilibrium(beams::BeamStructure(model));
      const auto estimate =
          estimate_discretisation(model, {beams::Subdivision::even(model, 1), solution.state});
      Case found;
      add_error(estimate.error, found);
      add_truth(model, solution.state, solution.report.elastic_energy, found);
      if (!solution.report.converged() || !estimate.error.is_known || !found.contains("true")) {
        ratios.add_unknown(known.name, "", elements);
        continue;
      }
      ratios.add(known.name, "", elements, found["estimate"], found["true"],
                 found["energy_estimate"], found["energy_true"]);
    }
  }
  ratios.finish();
}

}  // namespace

void estimates_suite(const SuiteOptions& options, Recorder& recorder) {
  run_linkages(options, recorder);
  run_beams(recorder);
}

}  // namespace limber::bench
