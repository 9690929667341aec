#include "engine/rods/linkage/size_derivatives.h"

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/rods/linkage/chain_size_derivatives.h"
#include "engine/rods/solver/chunk_sizes.h"

namespace limber::rods {
SizeDerivatives::SizeDerivatives(const LinkageModel& model)
    : model_(model),
      by_slot_(model.slots()),
      by_edge_{Eigen::Matrix2Xd(2, model.variables().joints()),
               Eigen::VectorXd(model.variables().segments())},
      result_{{},
              Eigen::VectorXd(model.variables().segments()),
              Eigen::VectorXd(model.edge_numbers().size()),
              Eigen::VectorXd(model.variables().segments())} {}

const LinkageVector& SizeDerivatives::evaluate(const LinkageState& state, double share,
                                               const Eigen::Ref<const Eigen::VectorXd>& v) {
  LIMBER_DEMAND(v.size() == model_.variables().size());
  evaluate_batches(state, share, v.data());
  return result_;
}

const LinkageVector& SizeDerivatives::evaluate(const LinkageState& state, double share) {
  evaluate_batches(state, share, nullptr);
  return result_;
}

void SizeDerivatives::evaluate_batches(const LinkageState& state, double share, const double* v) {
  const auto batches = static_cast<std::int64_t>(model_.chains()->batches().size());
  parallel_for(batches, detail::kBatchesPerChunk, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t b = begin; b < end; ++b) evaluate_batch(state, share, v, static_cast<int>(b));
  });
  gather();
}

void SizeDerivatives::evaluate_batch(const LinkageState& state, double share, const double* v,
                                     int index) {
  const ChainBatch& batch = model_.chains()->batches()[index];
  detail::LaneCell* const rests = by_slot_.data() + model_.first_slot(index);
  detail::LaneCell section;
  detail::evaluate_chain_sizes(model_, state, share, v, index, {rests[0].values, section.values});
  for (int lane = 0; lane < kChainLanes; ++lane) {
    const int chain = batch.chains[lane];
    if (chain < 0) continue;
    result_.sections[chain] = section.values[lane];
    double* const edges = result_.edges.data() + model_.edge_numbers().first_free(chain);
    double sum = 0;
    const int first = batch.has_start ? 1 : 0;
    for (int e = first; e < batch.edges - (batch.has_finish ? 1 : 0); ++e) {
      edges[e - first] = rests[e].values[lane];
      sum += rests[e].values[lane];
    }
    by_edge_.free_edge[chain] = sum;
  }
}

/// Terminal edges, which two segments share, and segments' lengths.
void SizeDerivatives::gather() {
  by_edge_.terminal.setZero();
  for (int s = 0; s < model_.variables().segments(); ++s) {
    const ChainBatches::Place place = model_.chains()->place(s);
    const detail::LaneCell* const rests = by_slot_.data() + model_.first_slot(place.batch);
    const Segment& segment = model_.graph().segments[s];
    for (const End end : {kStart, kFinish}) {
      if (segment.joints[end] < 0) continue;
      const int edge = end == kStart ? 0 : model_.variables().edges(s) - 1;
      by_edge_.terminal(segment.rods[end], segment.joints[end]) += rests[edge].values[place.lane];
    }
  }
  result_.lengths = model_.rest_length_map().transposed(by_edge_);
  for (int j = 0; j < model_.variables().joints(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const int edge = model_.edge_numbers().terminal(j, rod);
      if (edge >= 0) result_.edges[edge] = by_edge_.terminal(rod, j);
    }
  }
}

}  // namespace limber::rods
