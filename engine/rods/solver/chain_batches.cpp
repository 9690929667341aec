#include "engine/rods/solver/chain_batches.h"

#include <map>
#include <tuple>

#include "engine/base/error.h"
#include "engine/rods/solver/chain_elimination.h"

namespace limber::rods {

ChainBatches::ChainBatches(std::vector<Chain> chains, int joints)
    : chains_(std::move(chains)), joints_(joints), places_(chains_.size()) {
  std::map<std::tuple<int, bool, bool>, std::vector<int>> groups;
  chain_begin_.push_back(0);
  for (std::size_t c = 0; c < chains_.size(); ++c) {
    const Chain& chain = chains_[c];
    const bool start = chain.start_joint >= 0;
    const bool finish = chain.finish_joint >= 0;
    LIMBER_DEMAND(chain.edges >= 1 + (start ? 1 : 0) + (finish ? 1 : 0));
    LIMBER_DEMAND(chain.start_joint < joints && chain.finish_joint < joints);
    LIMBER_DEMAND(!start || chain.start_joint != chain.finish_joint);
    groups[{chain.edges, start, finish}].push_back(static_cast<int>(c));
    const int joint_numbers = kTerminalSize * ((start ? 1 : 0) + (finish ? 1 : 0));
    chain_begin_.push_back(chain_begin_.back() + 4 * chain.edges + 3 - joint_numbers);
  }
  for (const auto& [shape, members] : groups) {
    for (std::size_t first = 0; first < members.size(); first += kChainLanes) {
      ChainBatch batch{};
      std::tie(batch.edges, batch.has_start, batch.has_finish) = shape;
      batch.chains.fill(-1);
      for (std::size_t lane = 0; lane < kChainLanes && first + lane < members.size(); ++lane) {
        batch.chains[lane] = members[first + lane];
        places_[members[first + lane]] = {static_cast<int>(batches_.size()),
                                          static_cast<int>(lane)};
      }
      batch.band = band_lanes_;
      batch.factor = factor_lanes_;
      batch.work = work_lanes_;
      // One number more than the chain has: the last block is as full as the others.
      band_lanes_ += static_cast<std::size_t>(batch.numbers() + 1) * kBandHeight;
      factor_lanes_ +=
          static_cast<std::size_t>(batch.end_block() - batch.first_block()) * detail::kBlockFactor;
      work_lanes_ += static_cast<std::size_t>(batch.numbers()) + 1 + kTerminalSize;
      batches_.push_back(batch);
    }
  }
}

}  // namespace limber::rods
