#include "engine/beams/refinement/discretisation_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/base/index.h"
#include "engine/beams/results/beam_results.h"

namespace limber::beams {
namespace {

constexpr double kLeastOrder = 2, kLargestOrder = 4;

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

/// Energy of a moment that varies linearly between two ends, over its bending stiffness and length.
double linear_energy(double at_start, double at_finish) {
  return (at_start * at_start + at_start * at_finish + at_finish * at_finish) / 6;
}

double over(double value, double stiffness) { return stiffness > 0 ? value / stiffness : 0; }

/// Energy of the difference between a part's forces and those of its two halves.
double difference_energy(const BeamSection& section, double half_length, const ElementForces& part,
                         const ElementForces& first, const ElementForces& second) {
  double energy = 0;
  const double middle_2 = 0.5 * (part.start_moment_2 + part.finish_moment_2);
  const double middle_3 = 0.5 * (part.start_moment_3 + part.finish_moment_3);
  const auto add = [&](const ElementForces& half, double start_2, double finish_2, double start_3,
                       double finish_3) {
    const double axial = half.axial - part.axial, torque = half.torque - part.torque;
    energy += over(0.5 * axial * axial, section.stretching);
    energy += over(0.5 * torque * torque, section.torsion);
    energy += over(linear_energy(half.start_moment_2 - start_2, half.finish_moment_2 - finish_2),
                   section.bending_2);
    energy += over(linear_energy(half.start_moment_3 - start_3, half.finish_moment_3 - finish_3),
                   section.bending_3);
  };
  add(first, part.start_moment_2, middle_2, part.start_moment_3, middle_3);
  add(second, middle_2, part.finish_moment_2, middle_3, part.finish_moment_3);
  return energy * half_length;
}

std::vector<double> indicators_of(const BeamModel& model, const Subdivision& subdivision,
                                  const BeamResults& results, const Level& halves) {
  const BeamResults finer = results_of(halves.structure, halves.cut.state);
  std::vector<double> indicators;
  for (int e = 0; e < static_cast<int>(model.elements.size()); ++e) {
    double energy = 0;
    const BeamElement& element = model.elements[index(e)];
    for (int i = 0; i < subdivision.parts_of(e) && element.kind == BeamKind::kBeam; ++i) {
      const int half = halves.cut.subdivision.first_part(e) + 2 * i;
      energy += difference_energy(model.sections[index(element.section)],
                                  halves.structure.constants(half).length,
                                  results.forces[index(subdivision.first_part(e) + i)],
                                  finer.forces[index(half)], finer.forces[index(half + 1)]);
    }
    indicators.push_back(std::sqrt(energy));
  }
  return indicators;
}

void set_distances(const BeamModel& model, const Eigen::Matrix3Xd& distances,
                   DiscretisationError& error) {
  Eigen::Index worst = 0;
  error.max_distance = distances.colwise().norm().maxCoeff(&worst);
  error.worst_node = static_cast<int>(worst);
  error.position_error = error.max_distance / structure_size(model);
}

/// What is left of differences that fall by a power of the length of parts, over the last of them.
double rest_of(double order) { return 1 / (std::exp2(order) - 1); }

double relative_difference(double energy, double limit) {
  const double size = std::max(std::abs(energy), std::abs(limit));
  return size > 0 ? std::abs(energy - limit) / size : 0;
}

std::string describe_failure(const Level& level) {
  return fmt::format("no equilibrium of {} elements was found next to this one: {}",
                     level.structure.elements(), level.report.message);
}

void look_at_quarters(const BeamModel& model, const CutEquilibrium& cut, double energy,
                      const Level& halves, const JobContext& job,
                      DiscretisationEstimate& estimate) {
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
  error.energy_error = relative_difference(energy, finest + rest * (finest - finer_energy));
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
  const BeamResults results = results_of(structure, cut.state);
  const double energy = results.energies.total(), finer = halves.report.elastic_energy;
  error.is_known = true;
  error.compared_elements = halves.structure.elements();
  const double rest = rest_of(kLeastOrder);
  set_distances(model, (1 + rest) * displacements(model, cut.state, halves.cut.state), error);
  error.energy_error = relative_difference(energy, finer + rest * (finer - energy));
  estimate.indicators = indicators_of(model, cut.subdivision, results, halves);
  if (error.position_error > kSmallDiscretisationError && 4 * error.elements <= max_elements)
    look_at_quarters(model, cut, energy, halves, job, estimate);
  if (!estimate.finest) estimate.finest = std::move(halves.cut);
  return estimate;
}

}  // namespace limber::beams
