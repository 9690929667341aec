#include "engine/rods/linkage/chains.h"

#include "engine/base/error.h"

namespace limber::rods {

std::shared_ptr<const ChainBatches> chains_of(const LinkageGraph& graph,
                                              const ReducedVariables& variables) {
  std::vector<Chain> chains;
  for (int s = 0; s < variables.segments(); ++s) {
    const std::array<int, 2>& joints = graph.segments[s].joints;
    chains.push_back({variables.edges(s), joints[kStart], joints[kFinish]});
  }
  auto result = std::make_shared<const ChainBatches>(std::move(chains), variables.joints());
  LIMBER_DEMAND(result->size() == variables.size());
  return result;
}

}  // namespace limber::rods
