#include "engine/rods/linkage/rest_directions.h"

#include "engine/base/error.h"

namespace limber::rods::detail {

bool moves_rests(const LinkageVector& direction) {
  return direction.lengths.size() > 0 || direction.edges.size() > 0;
}

void spread_rests(const LinkageModel& model, const LinkageVector& direction,
                  std::vector<LaneCell>& rests) {
  rests.resize(model.slots());
  const EdgeNumbers& numbers = model.edge_numbers();
  Eigen::VectorXd change = direction.edges;
  if (direction.lengths.size() > 0) {
    const Eigen::VectorXd shared =
        numbers.listed(model.rest_length_map().apply_to_change(direction.lengths));
    if (change.size() == 0) change.setZero(shared.size());
    change += shared;
  }
  if (change.size() == 0) change.setZero(numbers.size());
  LIMBER_DEMAND(change.size() == numbers.size());
  for (int s = 0; s < model.variables().segments(); ++s) {
    const ChainBatches::Place place = model.chains()->place(s);
    for (int e = 0; e < model.variables().edges(s); ++e)
      rests[model.first_slot(place.batch) + e].values[place.lane] = change[numbers.edge(s, e)];
  }
}

}  // namespace limber::rods::detail
