#pragma once

#include <vector>

#include "engine/beams/results/beam_results.h"

namespace limber::beams {

/// A place of an element, with its forces and stresses.
struct Station {
  double place = 0;  // share of the length at rest, from the start
  SectionForces forces;
  double equivalent = 0;   // stress [force/length^2]
  double utilisation = 0;  // 0 where no yield stress is known
};

/// Stations at equal distances from start to finish of an element. @param count  >= 2
[[nodiscard]] std::vector<Station> stations_along(const BeamResults& results,
                                                  const BeamModel& model, int element, int count);

/// How many there are where nothing else is requested, and how many there may be.
inline constexpr int kDefaultStations = 11, kMaxStations = 201;

}  // namespace limber::beams
