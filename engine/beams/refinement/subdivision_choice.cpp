#include "engine/beams/refinement/subdivision_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/index.h"

namespace limber::beams {
namespace {

constexpr double kRefinedShare = 0.95;    // of the sum of indicators
constexpr double kCoarsenedShare = 0.25;  // of the tolerance
constexpr double kGrowth = 4;             // of an indicator where parts are twice as long
constexpr double kLeastSaving = 0.2;      // of the elements

/// Elements by their indicators, the smallest first.
std::vector<int> by_indicator(const std::vector<double>& indicators) {
  std::vector<int> order(indicators.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return indicators[index(a)] < indicators[index(b)]; });
  return order;
}

double sum_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

}  // namespace

Subdivision BeamDiscretisation::first(const BeamModel& model) const {
  return Subdivision::even(model, elements_per_member.value_or(1));
}

void BeamDiscretisation::validate() const {
  if (elements_per_member && (*elements_per_member < 1 || *elements_per_member > kMaxParts))
    throw Error(ErrorCode::kOutOfRange, "elements_per_member",
                fmt::format("{} must be in [1, {}]", *elements_per_member, kMaxParts));
  if (tolerance && !(*tolerance > 0 && *tolerance <= kMaxTolerance))
    throw Error(ErrorCode::kOutOfRange, "tolerance",
                fmt::format("{:g} must be in (0, {:g}]", *tolerance, kMaxTolerance));
  if (max_elements <= 0)
    throw Error(ErrorCode::kInvalidArgument, "max_elements",
                fmt::format("{} must be > 0", max_elements));
}

std::optional<Subdivision> refined_where_needed(const BeamModel& model,
                                                const Subdivision& subdivision,
                                                const std::vector<double>& indicators,
                                                int max_elements) {
  double left = kRefinedShare * sum_of(indicators);
  if (!(left > 0)) return {};
  const std::vector<int> order = by_indicator(indicators);
  std::vector<int> parts = subdivision.parts();
  for (auto e = order.rbegin(); e != order.rend() && left > 0; ++e) {
    left -= indicators[index(*e)];
    int& count = parts[index(*e)];
    if (2 * count > BeamDiscretisation::kMaxParts) return {};
    count *= 2;
  }
  Subdivision refined(model, std::move(parts));
  if (refined.elements() > max_elements) return {};
  return refined;
}

std::optional<Subdivision> coarsened_where_possible(const BeamModel& model,
                                                    const Subdivision& subdivision,
                                                    const std::vector<double>& indicators,
                                                    double error, double tolerance) {
  const double ratio = kCoarsenedShare * tolerance / std::max(error, 1e-300);
  if (ratio <= 1) return {};
  double room = sum_of(indicators) * (ratio - 1);
  std::vector<int> parts = subdivision.parts();
  for (const int e : by_indicator(indicators)) {
    int& count = parts[index(e)];
    if (count % 2 != 0) continue;
    room -= (kGrowth - 1) * indicators[index(e)];
    if (room < 0) break;
    count /= 2;
  }
  Subdivision coarser(model, std::move(parts));
  const int spared = subdivision.elements() - coarser.elements();
  if (spared < kLeastSaving * subdivision.elements()) return {};
  return coarser;
}

}  // namespace limber::beams
