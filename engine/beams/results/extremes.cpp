#include <algorithm>
#include <cmath>

#include "engine/beams/results/force_distribution.h"

namespace limber::beams {

namespace {

constexpr int kPlaces = 9;
constexpr double kSpacing = 1.0 / (kPlaces - 1);
constexpr int kParabolas = 3;  // each from a quarter of the distance of the one before
constexpr double kNarrower = 0.25;

struct Peak {
  double value = 0, place = 0;
};

/// The largest value of a function on [0, 1]. @param samples  at equal distances
template <class Function>
Peak peak_of(const std::array<double, kPlaces>& samples, const Function& function) {
  const auto most = std::max_element(samples.begin(), samples.end());
  const auto at = static_cast<int>(most - samples.begin());
  Peak peak{*most, at * kSpacing};
  // Around the largest sample, or beside it where that is an end.
  const auto inner = static_cast<std::size_t>(std::clamp(at, 1, kPlaces - 2));
  double middle = static_cast<double>(inner) * kSpacing, distance = kSpacing;
  double before = samples[inner - 1], here = samples[inner], after = samples[inner + 1];
  for (int i = 0; i < kParabolas; ++i) {
    const double curvature = before - 2 * here + after, slope = 0.5 * (after - before);
    // Straight but for rounding: the end it is.
    if (!(curvature < -1e-9 * (std::abs(here) + std::abs(slope)))) return peak;
    const double vertex = std::clamp(middle - distance * slope / curvature, 0.0, 1.0);
    const double value = function(vertex);
    if (value > peak.value) peak = {value, vertex};
    if (i + 1 == kParabolas || vertex == 0 || vertex == 1) return peak;
    distance *= kNarrower;
    middle = std::clamp(vertex, distance, 1 - distance);
    before = function(middle - distance);
    here = function(middle);
    after = function(middle + distance);
  }
  return peak;
}

}  // namespace

ElementExtremes extremes_of(const ElementForceDistribution& distribution) {
  std::array<std::array<double, kPlaces>, SectionForces::kComponents> samples{};
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const auto components = distribution.at(static_cast<double>(i) * kSpacing).components();
    for (std::size_t c = 0; c < components.size(); ++c) samples[c][i] = components[c];
  }
  ElementExtremes extremes;
  for (std::size_t c = 0; c < samples.size(); ++c) {
    const Peak largest =
        peak_of(samples[c], [&](double s) { return distribution.at(s).components()[c]; });
    std::array<double, kPlaces> negative{};
    std::transform(samples[c].begin(), samples[c].end(), negative.begin(), std::negate<>());
    const Peak least =
        peak_of(negative, [&](double s) { return -distribution.at(s).components()[c]; });
    extremes[c] = {-least.value, least.place, largest.value, largest.place};
  }
  return extremes;
}

GoverningStresses governing_stresses(const ElementForceDistribution& distribution,
                                     const BeamSection& section, const ElementExtremes& extremes) {
  const auto stress = [&](double s) { return stresses_of(section, distribution.at(s)).equivalent; };
  std::array<double, kPlaces> samples{};
  for (std::size_t i = 0; i < kPlaces; ++i) samples[i] = stress(static_cast<double>(i) * kSpacing);
  Peak peak = peak_of(samples, stress);
  // Stresses have kinks where moments change sign: their extremes are tried, too.
  for (const Extremes& of : extremes) {
    for (const double place : {of.least_place, of.largest_place}) {
      if (const double value = stress(place); value > peak.value) peak = {value, place};
    }
  }
  return {stresses_of(section, distribution.at(peak.place)), peak.place};
}

}  // namespace limber::beams
