// Beams that buckle, snap and rest in more than one shape: an answer must be a minimum.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/stability/beam_checks.h"
#include "bench/stability/elastica.h"
#include "bench/stability/sweep.h"
#include "tests/support/beam_columns.h"
#include "tests/support/beam_problems.h"

namespace limber::bench::stability {
namespace {

using beams::BeamModel;
using beams::BeamSolution;
using beams::BeamStructure;
using testing::Column;
using testing::ColumnEnds;

// Differences of energies leave so much of forces.
constexpr double kAllowedForce = 1e-4;
// Loads over Euler's at which eight elements resolve the elastica. Much beyond, ends that meet let
// it leave its plane, and a column between hinges turns over to hang: these are minima, too.
constexpr double kResolved = 0.02, kPlane = 0.6, kAllowedDeflection = 0.02;

Finding minimum(const BeamModel& model, const BeamSolution& found) {
  Finding finding = finding_of(found);
  finding.allowed = kAllowedForce;
  if (finding.is_finite) finding.error = minimum_error(BeamStructure(model), found.state);
  return finding;
}

Finding column(const Column& column) {
  const BeamModel model = column_model(column);
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  Finding finding = minimum(model, found);
  if (!(finding.error <= finding.allowed)) return finding;
  const double expected = elastica_deflection(column), is = deflection(column, found.state);
  const bool is_below = column.load < 1;
  const bool is_resolved = std::abs(column.load - 1) >= kResolved && column.load - 1 < kPlane;
  if (is_resolved && std::isfinite(expected)) {
    // In units of the limit: forces that balance at a wrong shape are no answer.
    const double off = is_below ? is : std::abs(is / expected - 1);
    finding.error = std::max(finding.error, off / kAllowedDeflection * kAllowedForce);
  }
  finding.message =
      fmt::format("deflection {:.3g} (elastica {:.3g}). {}", is, expected, finding.message);
  return finding;
}

/// How near to Euler's load, from below or from above.
void add_columns(Sweeps& sweeps) {
  for (const ColumnEnds ends :
       {ColumnEnds::kPinnedPinned, ColumnEnds::kClampedFree, ColumnEnds::kClampedPinned,
        ColumnEnds::kClampedGuided, ColumnEnds::kClampedClamped}) {
    for (const bool is_above : {false, true}) {
      for (const auto beside : {testing::Beside::kNothing, testing::Beside::kSoftCantilever}) {
        Sweep sweep;
        sweep.wing = "beams";
        sweep.name = fmt::format("column, {}, {} Euler's load{}", to_string(ends),
                                 is_above ? "above" : "below",
                                 beside == testing::Beside::kNothing ? "" : ", a soft one beside");
        sweep.parameter = is_above ? "load / Euler's - 1" : "1 - load / Euler's";
        sweep.asked = "a straight column of 8 elements under an end load";
        sweep.check = "differences of energy and forces; from 2 % on the elastica";
        sweep.values = {0.5, 0.2, 0.1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 0};
        if (is_above) sweep.values.insert(sweep.values.begin(), {1.0, 2.0, 4.0});
        sweep.required = is_above ? 4 : 3;
        sweep.run = [=](double value) {
          return column({ends, 8, is_above ? 1 + value : 1 - value, beside});
        };
        sweeps.push_back(std::move(sweep));
      }
    }
  }
}

Finding arch(double load, testing::ArchMoves moves) {
  const BeamModel model = testing::shallow_arch(load, moves);
  return minimum(model, find_equilibrium(BeamStructure(model)));
}

/// Snapped through under a load that is taken away again.
Finding arch_and_back(double load) {
  const BeamModel loaded = testing::shallow_arch(load);
  const BeamSolution down = find_equilibrium(BeamStructure(loaded));
  Finding first = minimum(loaded, down);
  if (first.claim != Claim::kConverged || !(first.error <= first.allowed)) return first;
  BeamModel model = loaded;
  model.loads.clear();
  return minimum(model, find_equilibrium_from(BeamStructure(model), down.state));
}

Finding compressed(double span, testing::BeamEnds ends) {
  constexpr int kElements = 40;
  const BeamModel model = testing::compressed_model(kElements, ends, span);
  const BeamSolution found = find_equilibrium(BeamStructure(model));
  // Ends that have passed each other leave more than one minimum.
  if (span < 0) return minimum(model, found);
  Finding finding = finding_of(found);
  const double height = compressed_height(span);
  finding.error = std::abs(found.state.positions.row(2).cwiseAbs().maxCoeff() / height - 1);
  finding.allowed = 0.01;
  return finding;
}

Finding pressed(double load) {
  BeamModel model = testing::pressed_cantilever(load * std::numbers::pi * std::numbers::pi / 4);
  return minimum(model, find_equilibrium(BeamStructure(model)));
}

Sweep branch_sweep(const char* name, const char* parameter, std::vector<double> values,
                   int required, std::function<Finding(double)> run) {
  Sweep sweep;
  sweep.wing = "beams";
  sweep.name = name;
  sweep.parameter = parameter;
  sweep.check = "differences of energy and forces: balance, and no direction that falls";
  sweep.values = std::move(values);
  sweep.required = required;
  sweep.run = std::move(run);
  return sweep;
}

}  // namespace

Sweeps beam_branch_sweeps() {
  Sweeps sweeps;
  add_columns(sweeps);
  const std::vector<double> loads = {1, 5, 20, 25, 30, 35, 40, 45, 50, 60, 100, 1e3, 1e4};
  Sweep shallow =
      branch_sweep("shallow arch in its plane", "load at its crown", loads, 11,
                   [](double load) { return arch(load, testing::ArchMoves::kInItsPlane); });
  shallow.asked = "an arch of rise 0.05, clamped, that snaps through";
  sweeps.push_back(shallow);
  shallow.name = "shallow arch in space";
  shallow.run = [](double load) { return arch(load, testing::ArchMoves::kInSpace); };
  sweeps.push_back(shallow);
  shallow.name = "shallow arch, loaded and unloaded";
  shallow.asked = "the shape that stays when the load is gone";
  shallow.run = arch_and_back;
  sweeps.push_back(shallow);
  Sweep press = branch_sweep("pressed cantilever", "load / Euler's",
                             {0.5, 0.9, 0.99, 1, 1.01, 1.1, 2, 5, 10, 20, 50, 100}, 8, pressed);
  press.asked = "a cantilever pressed along its axis, with a small force aside";
  sweeps.push_back(press);
  for (const auto ends : {testing::BeamEnds::kHinged, testing::BeamEnds::kClamped}) {
    Sweep sweep = branch_sweep(ends == testing::BeamEnds::kHinged ? "compressed between hinges"
                                                                  : "compressed between clamps",
                               "span over length",
                               {0.99, 0.9, 0.7, 0.5, 0.3, 0.1, 0.01, 0.001, -0.1, -0.3, -0.6}, 6,
                               [=](double span) { return compressed(span, ends); });
    sweep.asked = "a straight beam of 40 elements whose ends are brought together";
    sweep.check =
        "the elastica's height, by elliptic integrals; below 0 differences of energy and forces";
    sweeps.push_back(sweep);
  }
  return sweeps;
}

}  // namespace limber::bench::stability
