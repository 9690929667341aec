#include "engine/rods/linkage/linkage_assembly.h"

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/rods/linkage/chain_energy.h"
#include "engine/rods/linkage/chain_size_forces.h"
#include "engine/rods/linkage/rest_directions.h"
#include "engine/rods/solver/chunk_sizes.h"
#include "engine/rods/solver/lane_transpose.h"

namespace limber::rods {
LinkageAssembly::LinkageAssembly(const LinkageModel& model)
    : model_(model), ends_(static_cast<std::size_t>(model.chains()->joints())) {
  const ChainBatches& chains = *model.chains();
  first_number_.push_back(0);
  for (const ChainBatch& batch : chains.batches())
    first_number_.push_back(first_number_.back() + static_cast<std::size_t>(batch.numbers()));
  numbers_.resize(first_number_.back());
  energies_.resize(3 * chains.batches().size());
  end_gradients_.resize(2 * chains.chains().size());
  for (std::size_t c = 0; c < chains.chains().size(); ++c) {
    for (const End end : {kStart, kFinish}) {
      const int joint = model.graph().segments[c].joints[end];
      if (joint >= 0) ends_[joint].push_back(2 * static_cast<int>(c) + end);
    }
  }
}

RodEnergies LinkageAssembly::energies(const LinkageState& state) {
  parallel_for(static_cast<std::int64_t>(model_.chains()->batches().size()),
               detail::kBatchesPerChunk, [&](std::int64_t begin, std::int64_t end) {
                 for (std::int64_t i = begin; i < end; ++i) {
                   const int b = static_cast<int>(i);
                   detail::evaluate_chains(model_.chains()->batches()[b], state.slots(model_, b),
                                           model_.slot_parameters(b), model_.stiffness(),
                                           model_.form(), {energies_of(b)});
                 }
               });
  return total();
}

RodEnergies LinkageAssembly::gradient(const LinkageState& state,
                                      Eigen::Ref<Eigen::VectorXd> gradient) {
  LIMBER_DEMAND(gradient.size() == model_.chains()->size());
  parallel_for(static_cast<std::int64_t>(model_.chains()->batches().size()),
               detail::kBatchesPerChunk, [&](std::int64_t begin, std::int64_t end) {
                 for (std::int64_t i = begin; i < end; ++i) {
                   const int b = static_cast<int>(i);
                   detail::evaluate_chains(model_.chains()->batches()[b], state.slots(model_, b),
                                           model_.slot_parameters(b), model_.stiffness(),
                                           model_.form(),
                                           {energies_of(b), numbers_[first_number_[b]].values});
                   collect(b, gradient);
                 }
               });
  finish_joints(state, gradient, nullptr);
  return total();
}

RodEnergies LinkageAssembly::hessian(const LinkageState& state,
                                     Eigen::Ref<Eigen::VectorXd> gradient, CondensedMatrix& hessian,
                                     Compression compression) {
  return hessian_as(state, gradient, hessian, compression, nullptr);
}

RodEnergies LinkageAssembly::hessian(const LinkageState& state,
                                     Eigen::Ref<Eigen::VectorXd> gradient, CondensedMatrix& hessian,
                                     const EdgeTensions& tensions) {
  return hessian_as(state, gradient, hessian, Compression::kBuckles, &tensions);
}

RodEnergies LinkageAssembly::hessian_as(const LinkageState& state,
                                        Eigen::Ref<Eigen::VectorXd> gradient,
                                        CondensedMatrix& hessian, Compression compression,
                                        const EdgeTensions* tensions) {
  LIMBER_DEMAND(gradient.size() == model_.chains()->size());
  LIMBER_DEMAND(hessian.shared_structure() == model_.chains());
  parallel_for(static_cast<std::int64_t>(model_.chains()->batches().size()),
               detail::kBatchesPerChunk, [&](std::int64_t begin, std::int64_t end) {
                 for (std::int64_t i = begin; i < end; ++i) {
                   const int b = static_cast<int>(i);
                   detail::evaluate_chains(
                       model_.chains()->batches()[b], state.slots(model_, b),
                       model_.slot_parameters(b), model_.stiffness(), model_.form(),
                       {energies_of(b), numbers_[first_number_[b]].values, hessian.band(b),
                        compression, tensions == nullptr ? nullptr : tensions->of(model_, b)});
                   collect(b, gradient);
                 }
               });
  finish_joints(state, gradient, &hessian);
  return total();
}

void LinkageAssembly::gradient_change(const LinkageState& state, const LinkageVector& sizes,
                                      Eigen::Ref<Eigen::VectorXd> change) {
  LIMBER_DEMAND(change.size() == model_.chains()->size());
  detail::spread_rests(model_, sizes, rests_);
  const auto change_batch = [&](int b) {
    const ChainBatch& batch = model_.chains()->batches()[b];
    detail::LaneCell growth;
    for (int lane = 0; lane < kChainLanes; ++lane) {
      const int segment = batch.chains[lane];
      if (segment >= 0 && sizes.sections.size() > 0)
        growth.values[lane] = sizes.sections[segment] / model_.section_scales()[segment];
    }
    detail::evaluate_chain_size_forces(batch.edges, state.slots(model_, b),
                                       model_.slot_parameters(b), model_.stiffness(), model_.form(),
                                       rests_.data() + model_.first_slot(b), growth.values,
                                       numbers_[first_number_[b]].values);
    collect(b, change);
  };
  parallel_for(static_cast<std::int64_t>(model_.chains()->batches().size()),
               detail::kBatchesPerChunk, [&](std::int64_t begin, std::int64_t end) {
                 for (std::int64_t b = begin; b < end; ++b) change_batch(static_cast<int>(b));
               });
  finish_joints(state, change, nullptr);
}

/// Gradients of a batch to the chains' unknowns and to the ends' lists.
void LinkageAssembly::collect(int b, Eigen::Ref<Eigen::VectorXd> gradient) {
  const ChainBatch& batch = model_.chains()->batches()[b];
  const auto* const numbers =
      reinterpret_cast<const detail::Lanes*>(numbers_[first_number_[b]].values);
  const auto scatter = [&](int first, int count, const auto& of_chain) {
    double* rows[kChainLanes];
    for (int lane = 0; lane < kChainLanes; ++lane)
      rows[lane] = batch.chains[lane] < 0 ? nullptr : of_chain(batch.chains[lane]);
    detail::scatter_rows(numbers + first, count, rows);
  };
  scatter(batch.begin(), batch.end() - batch.begin(),
          [&](int chain) { return gradient.data() + model_.chains()->chain_begin(chain); });
  for (const End end : {kStart, kFinish}) {
    scatter(end == kStart ? 0 : batch.numbers() - kTerminalNumbers, kTerminalNumbers,
            [&](int chain) { return end_gradients_[2 * chain + end].data(); });
  }
}

void LinkageAssembly::finish_joints(const LinkageState& state, Eigen::Ref<Eigen::VectorXd> gradient,
                                    CondensedMatrix* hessian) {
  const ChainBatches& chains = *model_.chains();
  const auto finish = [&](int joint) {
    using Block = Eigen::Matrix<double, kJointUnknowns, kJointUnknowns>;
    Eigen::Matrix<double, kJointUnknowns, 1> sum = Eigen::Matrix<double, kJointUnknowns, 1>::Zero();
    Block curvature = Block::Zero();
    const JointState<double>& here = state.joints()[joint];
    const auto tangents = here.tangents();
    for (const int index : ends_[joint]) {
      const Segment& segment = model_.graph().segments[index / 2];
      const int end = index % 2;
      const RodOfJoint rod = segment.rods[end];
      const TerminalEdgeSource<double> source = {here.position, here.normal,
                                                 tangents[rod], here.lengths[rod],
                                                 rod,           double(segment.signs[end])};
      sum += terminal_gradient(source, end_gradients_[index]);
      if (hessian == nullptr) continue;
      hessian->set_terminal(index / 2, end, terminal_jacobian(source));
      curvature += terminal_curvature(source, end_gradients_[index]);
    }
    gradient.segment<kJointUnknowns>(chains.joint_begin(joint)) = sum;
    if (hessian != nullptr) Eigen::Map<Block>(hessian->joint(joint)) = curvature;
  };
  parallel_for(chains.joints(), detail::kJointsPerChunk, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t j = begin; j < end; ++j) finish(static_cast<int>(j));
  });
}

Eigen::Matrix<double, kJointUnknowns, 1> LinkageAssembly::end_gradient(const LinkageState& state,
                                                                       int segment, End end) const {
  const Segment& of = model_.graph().segments[static_cast<std::size_t>(segment)];
  LIMBER_DEMAND(of.joints[end] >= 0);
  const auto& joint = state.joints()[static_cast<std::size_t>(of.joints[end])];
  return terminal_gradient(terminal_edge_source(joint, of.rods[end], of.signs[end]),
                           end_gradients_[2 * static_cast<std::size_t>(segment) + end]);
}

RodEnergies LinkageAssembly::total() const {
  RodEnergies sum;
  const std::vector<ChainBatch>& batches = model_.chains()->batches();
  for (std::size_t b = 0; b < batches.size(); ++b) {
    for (int lane = 0; lane < kChainLanes; ++lane) {
      if (batches[b].chains[lane] < 0) continue;
      sum.stretching += energies_[3 * b].values[lane];
      sum.bending += energies_[3 * b + 1].values[lane];
      sum.twisting += energies_[3 * b + 2].values[lane];
    }
  }
  return sum;
}

Eigen::VectorXd LinkageAssembly::segment_energies() const {
  Eigen::VectorXd result(static_cast<Eigen::Index>(model_.chains()->chains().size()));
  for (Eigen::Index s = 0; s < result.size(); ++s) {
    const ChainBatches::Place place = model_.chains()->place(static_cast<int>(s));
    result[s] = 0;
    for (int part = 0; part < 3; ++part)
      result[s] += energies_of(place.batch)[part * kChainLanes + place.lane];
  }
  return result;
}

}  // namespace limber::rods
