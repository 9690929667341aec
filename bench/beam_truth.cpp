#include "bench/beam_truth.h"

#include <Eigen/Dense>
#include <cmath>

#include "tests/support/beam_problems.h"

namespace limber::bench {
namespace {

using beams::BeamModel;
using beams::BeamState;
using beams::BeamStructure;
using beams::Subdivision;
using testing::BeamEnds;

constexpr int kTrueParts = 16;  // parts an element that count as the limit

BeamModel evenly_loaded(int elements) {
  BeamModel model = testing::straight_beam(elements);
  model.supports.push_back(testing::clamped(0));
  for (int i = 0; i < elements; ++i) model.distributed_loads.push_back({i, {0, 0, -3}});
  return model;
}

const KnownStructure kKnown[] = {
    {"cantilever, alpha 1", [](int n) { return testing::cantilever_model(n, 1); }},
    {"cantilever, alpha 10", [](int n) { return testing::cantilever_model(n, 10); }},
    {"evenly loaded", evenly_loaded},
    {"elastica, hinged, span .3",
     [](int n) { return testing::compressed_model(n, BeamEnds::kHinged, 0.3); }},
    {"elastica, clamped, span .3",
     [](int n) { return testing::compressed_model(n, BeamEnds::kClamped, 0.3); }},
    {"roll-up to a circle", testing::roll_up_model},
    {"45 degree bend, F 600", [](int n) { return testing::bend_model(n, 600, 1.0 / 6); }}};

/// The equilibrium next to a state, of even parts.
beams::BeamSolution next_to(const BeamModel& model, const BeamState& state, int parts) {
  const Subdivision fine = Subdivision::even(model, parts);
  return find_equilibrium_from(
      BeamStructure(cut_model(model, fine)),
      carry_state(BeamStructure(model), Subdivision::even(model, 1), state, fine));
}

}  // namespace

std::span<const KnownStructure> known_structures() { return kKnown; }

BeamModel without_temporary_loads(BeamModel model) {
  model.temporary_loads.clear();
  return model;
}

Eigen::VectorXd distances(const BeamState& a, const BeamState& b, Eigen::Index nodes) {
  return (a.positions.leftCols(nodes) - b.positions.leftCols(nodes)).colwise().norm();
}

void add_error(const beams::DiscretisationError& error, Case& result) {
  result["elements"] = error.elements;
  result["estimate"] = error.position_error;
  result["order"] = error.order;
  result["energy_estimate"] = error.energy_error;
  result["compared_elements"] = error.compared_elements;
  result["remark"] = error.message;
}

void add_truth(const BeamModel& model, const BeamState& state, double energy, Case& result) {
  const beams::BeamSolution limit = next_to(without_temporary_loads(model), state, kTrueParts);
  result["limit"] = to_string(limit.report.status);
  if (!limit.report.converged()) return;
  const Eigen::VectorXd off = distances(state, limit.state, state.positions.cols());
  const double largest = off.maxCoeff() / structure_size(model);
  result["true"] = largest;
  result["estimate_over_true"] = result["estimate"].get<double>() / largest;
  result["energy_true"] =
      std::abs(energy - limit.report.elastic_energy) / limit.report.elastic_energy;
}

}  // namespace limber::bench
