#include "engine/beams/results/stations.h"

#include "engine/base/error.h"
#include "engine/base/index.h"

namespace limber::beams {

std::vector<Station> stations_along(const BeamResults& results, const BeamModel& model, int element,
                                    int count) {
  LIMBER_DEMAND(count >= 2);
  const BeamSection& section = model.sections[index(model.elements[index(element)].section)];
  std::vector<Station> stations;
  for (int i = 0; i < count; ++i) {
    Station station;
    station.place = static_cast<double>(i) / (count - 1);
    station.forces = results.distributions.at(element, station.place);
    const ElementStresses stresses = stresses_of(section, station.forces);
    station.equivalent = stresses.equivalent;
    station.utilisation = stresses.utilisation;
    stations.push_back(station);
  }
  return stations;
}

}  // namespace limber::beams
