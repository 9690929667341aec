#include "engine/beams/refinement/force_errors.h"

#include <algorithm>
#include <cmath>

#include "engine/base/index.h"

namespace limber::beams::detail {

namespace {

constexpr int kIntervals = 8;  // of a part, between the places that are compared
// Rounding of angles and stresses is no error: over EI / L, and of the yield stress.
constexpr double kMomentRounding = 1e-10, kUtilisationRounding = 1e-8;

// Three points of Gauss on [0, 1].
constexpr double kGaussPlaces[] = {0.1127016653792583, 0.5, 0.8872983346207417};
constexpr double kGaussWeights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};

double bending_of(const BeamSection& section) {
  return std::max(section.bending_2, section.bending_3);
}

/// Weights of the first and the second difference in the remainder to the limit.
struct Extrapolation {
  double first = 1, second = 0;
};
Extrapolation extrapolation(double largest_first, std::optional<double> largest_second) {
  if (!largest_second) return {1 + rest_of(kLeastOrder), 0};
  const double ratio = largest_first / std::max(*largest_second, 1e-300);
  const double order = std::log2(std::max(ratio, 1.0));
  return {1, 1 + rest_of(std::clamp(order, kLeastOrder, kLargestOrder))};
}

double largest_difference(const SampledForces& a, const SampledForces& b) {
  double largest = 0;
  for (std::size_t e = 0; e < a.moments.size(); ++e)
    largest = std::max(largest, (b.moments[e] - a.moments[e]).colwise().norm().maxCoeff());
  return largest;
}

void set_moment_error(const SampledForces& coarse, const SampledForces& halves,
                      const SampledForces* quarters, DiscretisationError& error) {
  const auto second = quarters == nullptr
                          ? std::optional<double>()
                          : std::optional<double>(largest_difference(halves, *quarters));
  const Extrapolation weights = extrapolation(largest_difference(coarse, halves), second);
  error.max_moment_error = 0;
  for (std::size_t e = 0; e < coarse.moments.size(); ++e) {
    Eigen::Matrix2Xd off = weights.first * (halves.moments[e] - coarse.moments[e]);
    if (quarters != nullptr) off += weights.second * (quarters->moments[e] - halves.moments[e]);
    const double largest = off.colwise().norm().maxCoeff();
    if (error.worst_moment_element >= 0 && largest <= error.max_moment_error) continue;
    error.max_moment_error = largest;
    error.worst_moment_element = static_cast<int>(e);
  }
  const double scale = std::max({coarse.moment_scale, halves.moment_scale,
                                 quarters == nullptr ? 0.0 : quarters->moment_scale});
  error.moment_error = scale > 0 ? error.max_moment_error / scale : 0;
}

void set_utilisation_error(const SampledForces& coarse, const SampledForces& halves,
                           const SampledForces* quarters, DiscretisationError& error) {
  double first = 0, second = 0, scale = kUtilisationRounding;
  for (std::size_t e = 0; e < coarse.utilisations.size(); ++e) {
    first = std::max(first, std::abs(halves.utilisations[e] - coarse.utilisations[e]));
    scale = std::max({scale, coarse.utilisations[e], halves.utilisations[e]});
    if (quarters == nullptr) continue;
    second = std::max(second, std::abs(quarters->utilisations[e] - halves.utilisations[e]));
    scale = std::max(scale, quarters->utilisations[e]);
  }
  const Extrapolation weights =
      extrapolation(first, quarters == nullptr ? std::optional<double>() : second);
  double worst = -1;
  for (std::size_t e = 0; e < coarse.utilisations.size(); ++e) {
    double off = weights.first * (halves.utilisations[e] - coarse.utilisations[e]);
    if (quarters != nullptr)
      off += weights.second * (quarters->utilisations[e] - halves.utilisations[e]);
    if (std::abs(off) <= worst) continue;
    worst = std::abs(off);
    error.worst_utilisation_element = static_cast<int>(e);
  }
  error.utilisation_error = std::max(worst, 0.0) / scale;
}

}  // namespace

SampledForces sample_forces(const BeamModel& model, const BeamResults& results,
                            const Subdivision& places) {
  SampledForces sampled;
  // Cables alone are never cut: there is nothing to compare.
  if (std::none_of(model.elements.begin(), model.elements.end(),
                   [](const BeamElement& e) { return e.kind == BeamKind::kBeam; }))
    return sampled;
  bool has_utilisation = false;
  for (int e = 0; e < static_cast<int>(model.elements.size()); ++e) {
    const BeamSection& section = model.sections[index(model.elements[index(e)].section)];
    const int intervals = kIntervals * places.parts_of(e);
    Eigen::Matrix2Xd moments(2, intervals + 1);
    for (int i = 0; i <= intervals; ++i) {
      const SectionForces forces = results.distributions.at(e, static_cast<double>(i) / intervals);
      moments.col(i) << forces.moment_2, forces.moment_3;
    }
    const double gyration = std::sqrt(bending_of(section) / section.stretching);
    sampled.moment_scale =
        std::max({sampled.moment_scale, moments.colwise().norm().maxCoeff(),
                  gyration * std::abs(results.forces[index(e)].axial),
                  kMomentRounding * bending_of(section) / drawn_length(model, e)});
    sampled.moments.push_back(std::move(moments));
    sampled.utilisations.push_back(results.stresses[index(e)].utilisation);
    has_utilisation = has_utilisation || section.yield_stress > 0;
  }
  if (!has_utilisation) sampled.utilisations.clear();
  return sampled;
}

void set_force_errors(const SampledForces& coarse, const SampledForces& halves,
                      const SampledForces* quarters, DiscretisationError& error) {
  error.worst_moment_element = error.worst_utilisation_element = -1;
  set_moment_error(coarse, halves, quarters, error);
  if (!coarse.utilisations.empty()) set_utilisation_error(coarse, halves, quarters, error);
}

std::vector<double> difference_energies(const BeamModel& model, const Subdivision& subdivision,
                                        const BeamResults& results, const BeamResults& halves) {
  const auto over = [](double force, double stiffness) {
    return stiffness > 0 ? 0.5 * force * force / stiffness : 0;
  };
  std::vector<double> energies;
  for (int e = 0; e < static_cast<int>(model.elements.size()); ++e) {
    const BeamElement& element = model.elements[index(e)];
    const BeamSection& section = model.sections[index(element.section)];
    double energy = 0;
    const int count = element.kind == BeamKind::kBeam ? 2 * subdivision.parts_of(e) : 0;
    const double rest = element.rest_length > 0 ? element.rest_length : drawn_length(model, e);
    for (int half = 0; half < count; ++half) {
      for (std::size_t g = 0; g < 3; ++g) {
        const double share = (half + kGaussPlaces[g]) / count;
        const SectionForces a = results.distributions.at(e, share);
        const SectionForces b = halves.distributions.at(e, share);
        energy += kGaussWeights[g] * rest / count *
                  (over(b.axial - a.axial, section.stretching) +
                   over(b.torque - a.torque, section.torsion) +
                   over(b.moment_2 - a.moment_2, section.bending_2) +
                   over(b.moment_3 - a.moment_3, section.bending_3));
      }
    }
    energies.push_back(std::sqrt(energy));
  }
  return energies;
}

}  // namespace limber::beams::detail
