#include "engine/beams/refinement/member_results.h"

#include <utility>
#include <vector>

#include "engine/base/index.h"

namespace limber::beams {

namespace {

/// Extremes of parts of equal length, as those of the whole.
void widen(const Extremes& of_part, int part, int parts, Extremes& whole) {
  const auto place = [&](double within) { return (part + within) / parts; };
  if (part == 0 || of_part.least < whole.least) {
    whole.least = of_part.least;
    whole.least_place = place(of_part.least_place);
  }
  if (part == 0 || of_part.largest > whole.largest) {
    whole.largest = of_part.largest;
    whole.largest_place = place(of_part.largest_place);
  }
}

void gather_element(const BeamResults& results, int first, int parts, BeamResults& gathered) {
  ElementExtremes extremes;
  double energy = 0;
  int governing = 0;
  for (int i = 0; i < parts; ++i) {
    for (std::size_t c = 0; c < extremes.size(); ++c)
      widen(results.extremes[index(first + i)][c], i, parts, extremes[c]);
    energy += results.element_energies[index(first + i)];
    if (results.stresses[index(first + i)].equivalent >
        results.stresses[index(first + governing)].equivalent)
      governing = i;
  }
  const auto& distributions = results.distributions.parts();
  gathered.extremes.push_back(extremes);
  gathered.forces.push_back(element_forces(extremes, distributions[index(first)].at(0),
                                           distributions[index(first + parts - 1)].at(1)));
  gathered.stresses.push_back(results.stresses[index(first + governing)]);
  gathered.governing_places.push_back(
      (governing + results.governing_places[index(first + governing)]) / parts);
  gathered.element_energies.push_back(energy);
}

}  // namespace

BeamResults member_results(const BeamResults& results, const Subdivision& subdivision) {
  if (subdivision.is_whole()) return results;
  BeamResults gathered;
  const int nodes = subdivision.given_nodes();
  gathered.reaction_forces = results.reaction_forces.leftCols(nodes);
  gathered.reaction_moments = results.reaction_moments.leftCols(nodes);
  gathered.energies = results.energies;
  gathered.largest_utilisation = results.largest_utilisation;
  gathered.largest_bend = results.largest_bend;
  std::vector<int> first_part;
  for (int e = 0; e < static_cast<int>(subdivision.parts().size()); ++e) {
    first_part.push_back(subdivision.first_part(e));
    gather_element(results, first_part.back(), subdivision.parts_of(e), gathered);
  }
  first_part.push_back(subdivision.elements());
  gathered.distributions = {results.distributions.parts(), std::move(first_part)};
  return gathered;
}

}  // namespace limber::beams
