#include "engine/beams/refinement/discretisation_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/index.h"
#include "engine/beams/refinement/force_errors.h"
#include "engine/beams/refinement/member_results.h"
#include "engine/beams/results/beam_results.h"

namespace limber::beams {
namespace {

using detail::kLargestOrder;
using detail::kLeastOrder;
using detail::rest_of;

/// Cables whose force their own sag changes by a smaller share are as straight as they are drawn.
constexpr double kTautCable = 1e-3;

/// One refinement: the equilibrium of the halves.
struct Level {
  CutEquilibrium cut;
  BeamStructure structure;
  BeamReport report;
};

BeamModel without_temporary_loads(BeamModel model) {
  model.temporary_loads.clear();
  return model;
}

Level refine(const BeamModel& model, const BeamStructure& structure, const CutEquilibrium& cut,
             const JobContext& job) {
  const Subdivision halves = cut.subdivision.halved(model);
  BeamStructure finer(cut_model(model, halves));
  const BeamState start = carry_state(structure, cut.subdivision, cut.state, halves);
  BeamSolution found = find_equilibrium_from(finer, start, {}, job);
  job.throw_if_cancelled();
  return {{halves, std::move(found.state)}, std::move(finer), std::move(found.report)};
}

Eigen::Matrix3Xd displacements(const BeamModel& model, const BeamState& from, const BeamState& to) {
  const auto nodes = static_cast<Eigen::Index>(model.nodes.size());
  return to.positions.leftCols(nodes) - from.positions.leftCols(nodes);
}

double largest(const Eigen::Matrix3Xd& vectors) { return vectors.colwise().norm().maxCoeff(); }

/// A cable of tension T sags under a load W across it, which shortens its chord by W^2 / (24 T^2).
/// @returns the first cable whose force this changes, in words; empty: none
std::string describe_sagging_cable(const BeamStructure& structure, const BeamState& state) {
  const BeamModel& model = structure.model();
  const NodeLoads loads = NodeLoads::of(model);
  for (int e = 0; e < structure.elements(); ++e) {
    const BeamElement& element = model.elements[index(e)];
    if (element.kind != BeamKind::kCable) continue;
    const ElementEnds ends = structure.ends(state, e);
    const Eigen::Vector3d load = load_over(structure, loads, ends, e).resultant();
    const double across = load.cross((ends.finish - ends.start).normalized()).norm();
    const double tension = strain_force(structure, state, e);
    const double stiffness = model.sections[index(element.section)].stretching;
    if (stiffness * across * across <= kTautCable * 24 * tension * tension * tension) continue;
    return fmt::format(
        "{} is a cable that sags under a load over its length, {:.3g} across a tension of {:.3g}, "
        "and cables are not cut: draw it with more elements",
        element_name(model, e), across, tension);
  }
  return {};
}

/// Results of the elements of the structure.
BeamResults results_of_members(const Level& level) {
  return member_results(results_of(level.structure, level.cut.state), level.cut.subdivision);
}

void set_distances(const BeamModel& model, const Eigen::Matrix3Xd& distances,
                   DiscretisationError& error) {
  Eigen::Index worst = 0;
  error.max_distance = distances.colwise().norm().maxCoeff(&worst);
  error.worst_node = static_cast<int>(worst);
  error.position_error = error.max_distance / structure_size(model);
}

double relative_difference(double energy, double limit) {
  const double size = std::max(std::abs(energy), std::abs(limit));
  return size > 0 ? std::abs(energy - limit) / size : 0;
}

std::string describe_failure(const Level& level) {
  return fmt::format("no equilibrium of {} elements was found next to this one: {}",
                     level.structure.elements(), level.report.message);
}

/// The compared levels: the equilibrium and that of its halves.
struct Compared {
  const BeamModel& model;
  const CutEquilibrium& cut;
  const BeamResults& results;  // of the structure's elements
  const detail::SampledForces& forces;
  const Level& halves;
  const detail::SampledForces& finer_forces;
};

void look_at_quarters(const Compared& compared, const JobContext& job,
                      DiscretisationEstimate& estimate) {
  const auto& [model, cut, results, forces, halves, finer_forces] = compared;
  DiscretisationError& error = estimate.error;
  Level quarters = refine(model, halves.structure, halves.cut, job);
  if (!quarters.report.converged()) {
    error.message = describe_failure(quarters);
    return;
  }
  const Eigen::Matrix3Xd first = displacements(model, cut.state, halves.cut.state);
  const Eigen::Matrix3Xd second = displacements(model, halves.cut.state, quarters.cut.state);
  const double ratio = largest(first) / std::max(largest(second), 1e-300);
  error.order = std::clamp(std::log2(std::max(ratio, 1.0)), 0.0, kLargestOrder);
  if (error.order < kLeastOrder - 1)
    error.message = fmt::format(
        "differences do not fall yet: halves move nodes by up to {:.2g}, quarters by {:.2g} more",
        largest(first), largest(second));
  const double rest = rest_of(std::max(error.order, kLeastOrder));
  set_distances(model, first + (1 + rest) * second, error);
  const double finer_energy = halves.report.elastic_energy, finest = quarters.report.elastic_energy;
  error.energy_error =
      relative_difference(results.energies.total(), finest + rest * (finest - finer_energy));
  const detail::SampledForces finest_forces =
      detail::sample_forces(model, results_of_members(quarters), cut.subdivision);
  detail::set_force_errors(forces, finer_forces, &finest_forces, error);
  error.compared_elements = quarters.structure.elements();
  estimate.finest = std::move(quarters.cut);
}

}  // namespace

double structure_size(const BeamModel& model) {
  const std::vector<char> used = used_nodes(model);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  for (std::size_t i = 0; i < model.nodes.size(); ++i) {
    if (used[i] == 0) continue;
    low = low.cwiseMin(model.nodes[i].position);
    high = high.cwiseMax(model.nodes[i].position);
  }
  return (high - low).norm();
}

DiscretisationEstimate estimate_discretisation(const BeamModel& given, const CutEquilibrium& cut,
                                               int max_elements, const JobContext& job) {
  const BeamModel model = without_temporary_loads(given);
  const BeamStructure structure(cut_model(model, cut.subdivision));
  DiscretisationEstimate estimate;
  DiscretisationError& error = estimate.error;
  error.elements = structure.elements();
  if (error.elements == 0) {
    error.message = "there are no elements";
    return estimate;
  }
  if (2 * error.elements > max_elements) {
    error.message =
        fmt::format("halves of {} elements exceed the limit of {}", error.elements, max_elements);
    return estimate;
  }
  Level halves = refine(model, structure, cut, job);
  if (!halves.report.converged()) {
    error.message = describe_failure(halves);
    return estimate;
  }
  const BeamResults results = member_results(results_of(structure, cut.state), cut.subdivision);
  const double energy = results.energies.total(), finer = halves.report.elastic_energy;
  error.is_known = true;
  error.compared_elements = halves.structure.elements();
  const double rest = rest_of(kLeastOrder);
  set_distances(model, (1 + rest) * displacements(model, cut.state, halves.cut.state), error);
  error.energy_error = relative_difference(energy, finer + rest * (finer - energy));
  const BeamResults finer_results = results_of_members(halves);
  const auto forces = detail::sample_forces(model, results, cut.subdivision);
  const auto finer_forces = detail::sample_forces(model, finer_results, cut.subdivision);
  detail::set_force_errors(forces, finer_forces, nullptr, error);
  estimate.indicators = detail::difference_energies(model, cut.subdivision, results, finer_results);
  if (error.error_against(kSmallDiscretisationError) > kSmallDiscretisationError &&
      4 * error.elements <= max_elements)
    look_at_quarters({model, cut, results, forces, halves, finer_forces}, job, estimate);
  if (!estimate.finest) estimate.finest = std::move(halves.cut);
  if (std::string sagging = describe_sagging_cable(structure, cut.state); !sagging.empty()) {
    error.is_known = false;
    error.message = std::move(sagging);
  }
  return estimate;
}

}  // namespace limber::beams
