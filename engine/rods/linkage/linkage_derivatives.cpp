#include "engine/rods/linkage/linkage_derivatives.h"

#include <optional>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/rods/linkage/chain_derivatives.h"
#include "engine/rods/linkage/length_pattern.h"
#include "engine/rods/linkage/rest_directions.h"
#include "engine/rods/solver/chunk_sizes.h"

namespace limber::rods {
namespace {

/// Results of a batch's kernel.
struct Outputs {
  explicit Outputs(const ChainBatch& batch)
      : numbers(static_cast<std::size_t>(batch.numbers())),
        joints(2 * std::size_t{kJointUnknowns}),
        rests(static_cast<std::size_t>(batch.edges)) {}
  std::vector<detail::LaneCell> numbers, joints, rests;
  detail::LaneCell section{};
};

bool moves_rests(const LinkageVector* direction) {
  return direction != nullptr && detail::moves_rests(*direction);
}

}  // namespace

LinkageDerivatives::LinkageDerivatives(const LinkageModel& model)
    : model_(model),
      ends_(static_cast<std::size_t>(model.variables().joints())),
      by_joint_(2 * static_cast<std::size_t>(model.variables().segments())),
      by_rest_(static_cast<std::size_t>(model.variables().segments())) {
  for (int s = 0; s < model.variables().segments(); ++s) {
    for (const End end : {kStart, kFinish}) {
      const int joint = model.graph().segments[s].joints[end];
      if (joint >= 0) ends_[joint].push_back(2 * s + end);
    }
  }
}

LinkageVector LinkageDerivatives::gradient(const LinkagePoint& at) {
  return evaluate(at, 0, nullptr, nullptr);
}
LinkageVector LinkageDerivatives::second(const LinkagePoint& at, const LinkageVector& v) {
  return evaluate(at, 1, &v, nullptr);
}
LinkageVector LinkageDerivatives::third(const LinkagePoint& at, const LinkageVector& v,
                                        const LinkageVector& w, double share) {
  return evaluate(at, 2, &v, &w, share);
}

LinkageVector LinkageDerivatives::evaluate(const LinkagePoint& at, int order,
                                           const LinkageVector* v, const LinkageVector* w,
                                           double share) {
  const Eigen::Index size = model_.variables().size();
  const LinkageVector* const directions[] = {v, w};
  for (const int k : {0, 1}) {
    LIMBER_DEMAND(directions[k] == nullptr || directions[k]->unknowns.size() == 0 ||
                  directions[k]->unknowns.size() == size);
    if (moves_rests(directions[k]))
      detail::spread_rests(model_, *directions[k], rest_directions_[k]);
  }
  const auto unknowns = [&](int k) {
    return directions[k] == nullptr || directions[k]->unknowns.size() == 0
               ? nullptr
               : directions[k]->unknowns.data();
  };
  const auto rests = [&](int k) {
    return moves_rests(directions[k]) ? rest_directions_[k].data() : nullptr;
  };
  const auto sections = [&](int k) {
    return directions[k] == nullptr || directions[k]->sections.size() == 0
               ? nullptr
               : directions[k]->sections.data();
  };
  const bool away = at.increment.size() > 0;
  LIMBER_DEMAND(!away || at.increment.size() == size);
  std::optional<LinkageState> moved;
  if (away) moved = at.source.moved(model_, at.increment);
  const detail::ChainPoint point{model_,
                                 at.source,
                                 moved ? *moved : at.source,
                                 away ? at.increment.data() : nullptr,
                                 {unknowns(0), unknowns(1)},
                                 {rests(0), rests(1)},
                                 {sections(0), sections(1)},
                                 share};
  LinkageVector result{Eigen::VectorXd(size),
                       {},
                       Eigen::VectorXd(model_.edge_numbers().size()),
                       Eigen::VectorXd(model_.variables().segments())};
  parallel_for(static_cast<std::int64_t>(model_.chains()->batches().size()),
               detail::kBatchesPerChunk, [&](std::int64_t begin, std::int64_t end) {
                 for (std::int64_t b = begin; b < end; ++b)
                   evaluate_batch(point, static_cast<int>(b), order, result);
               });
  gather(result);
  return result;
}

/// One batch: its chains' unknowns at once, the rest to lists by segment.
void LinkageDerivatives::evaluate_batch(const detail::ChainPoint& point, int index, int order,
                                        LinkageVector& result) {
  const ChainBatch& batch = model_.chains()->batches()[index];
  Outputs out(batch);
  detail::evaluate_chain_derivatives(
      point, index, order,
      {out.numbers[0].values, out.joints[0].values, out.rests[0].values, out.section.values});
  for (int lane = 0; lane < kChainLanes; ++lane) {
    const int chain = batch.chains[lane];
    if (chain < 0) continue;
    double* const own = result.unknowns.data() + model_.chains()->chain_begin(chain);
    for (int k = batch.begin(); k < batch.end(); ++k)
      own[k - batch.begin()] = out.numbers[k].values[lane];
    for (const End end : {kStart, kFinish}) {
      for (int k = 0; k < kJointUnknowns; ++k)
        by_joint_[2 * chain + end][k] = out.joints[end * kJointUnknowns + k].values[lane];
    }
    by_rest_[chain].setZero();
    for (int e = 0; e < batch.edges; ++e) {
      const int kind = batch.has_start && e == 0                  ? 0
                       : batch.has_finish && e == batch.edges - 1 ? 1
                                                                  : 2;
      by_rest_[chain][kind] += out.rests[e].values[lane];
      if (kind == 2) result.edges[model_.edge_numbers().edge(chain, e)] = out.rests[e].values[lane];
    }
    result.sections[chain] = out.section.values[lane];
  }
}

void LinkageDerivatives::gather(LinkageVector& result) const {
  const int joints = model_.variables().joints();
  RestLengths by_edge{Eigen::Matrix2Xd::Zero(2, joints),
                      Eigen::VectorXd(model_.variables().segments())};
  for (int j = 0; j < joints; ++j) {
    Eigen::Matrix<double, kJointUnknowns, 1> sum = Eigen::Matrix<double, kJointUnknowns, 1>::Zero();
    for (const int index : ends_[j]) {
      sum += by_joint_[index];
      by_edge.terminal(model_.graph().segments[index / 2].rods[index % 2], j) +=
          by_rest_[index / 2][index % 2];
    }
    result.unknowns.segment<kJointUnknowns>(model_.variables().joint_begin(j)) = sum;
  }
  for (int s = 0; s < model_.variables().segments(); ++s) by_edge.free_edge[s] = by_rest_[s][2];
  result.lengths = model_.rest_length_map().transposed(by_edge);
  for (int j = 0; j < joints; ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const int edge = model_.edge_numbers().terminal(j, rod);
      if (edge >= 0) result.edges[edge] = by_edge.terminal(rod, j);
    }
  }
}

LinkageDerivatives::ByLengths LinkageDerivatives::by_lengths(const LinkagePoint& at,
                                                             const JobContext& context) {
  const int segments = model_.variables().segments();
  const ReducedVariables& variables = model_.variables();
  const LengthPattern pattern = length_pattern(model_.graph());
  std::vector<Eigen::Triplet<double>> unknowns, lengths;
  for (const std::vector<int>& colour : pattern.colours) {
    context.throw_if_cancelled();
    LinkageVector direction{{}, Eigen::VectorXd::Zero(segments)};
    for (const int s : colour) direction.lengths[s] = 1;
    const LinkageVector product = second(at, direction);
    const auto take = [&](int s, int begin, int count) {
      for (int i = begin; i < begin + count; ++i)
        if (product.unknowns[i] != 0) unknowns.emplace_back(i, s, product.unknowns[i]);
    };
    for (const int s : colour) {
      const LengthPattern::Reach& reach = pattern.reaches[s];
      for (const int other : reach.segments)
        take(s, model_.chains()->chain_begin(other), model_.chains()->chain_size(other));
      for (const int joint : reach.joints) take(s, variables.joint_begin(joint), kJointUnknowns);
      for (const int other : reach.lengths)
        if (product.lengths[other] != 0) lengths.emplace_back(other, s, product.lengths[other]);
    }
  }
  ByLengths result{{model_.variables().size(), segments}, {segments, segments}};
  result.unknowns.setFromTriplets(unknowns.begin(), unknowns.end());
  result.lengths.setFromTriplets(lengths.begin(), lengths.end());
  return result;
}

}  // namespace limber::rods
