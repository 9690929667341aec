#include "engine/rods/solver/condensed_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/numerics/block_ldlt.h"
#include "engine/base/parallel.h"
#include "engine/rods/solver/chain_elimination.h"
#include "engine/rods/solver/chunk_sizes.h"
#include "engine/rods/solver/lane_transpose.h"
#include "engine/rods/solver/terminal_transform.h"

namespace limber::rods {
namespace {

using detail::BlockLanes;
using detail::ChainAdjustment;
using detail::ChainRemainder;
using detail::LaneBuffer;
using detail::Lanes;

constexpr std::ptrdiff_t kTerminalLanes = kTerminalSize * kJointSize;
constexpr std::ptrdiff_t kBlockEntries = kJointSize * kJointSize;
constexpr std::int64_t kBatchesPerSolveChunk = 8;

/// One end of a chain at a joint, as an index 2 chain + end.
struct Incidence {
  std::vector<int> begin;  // joints + 1
  std::vector<int> ends;
};

Incidence find_ends(const ChainBatches& structure) {
  std::vector<std::vector<int>> at(static_cast<std::size_t>(structure.joints()));
  for (std::size_t c = 0; c < structure.chains().size(); ++c) {
    const Chain& chain = structure.chains()[c];
    const int index = 2 * static_cast<int>(c);
    if (chain.start_joint >= 0) at[chain.start_joint].push_back(index);
    if (chain.finish_joint >= 0) at[chain.finish_joint].push_back(index + 1);
  }
  Incidence incidence;
  incidence.begin.push_back(0);
  for (const std::vector<int>& list : at) {
    incidence.ends.insert(incidence.ends.end(), list.begin(), list.end());
    incidence.begin.push_back(static_cast<int>(incidence.ends.size()));
  }
  return incidence;
}

std::vector<std::pair<int, int>> find_couplings(const ChainBatches& structure,
                                                std::vector<int>& coupling_of) {
  std::vector<std::pair<int, int>> edges;
  for (const Chain& chain : structure.chains()) {
    const bool couples = chain.start_joint >= 0 && chain.finish_joint >= 0;
    coupling_of.push_back(couples ? static_cast<int>(edges.size()) : -1);
    if (couples) edges.emplace_back(chain.start_joint, chain.finish_joint);
  }
  return edges;
}

}  // namespace

class CondensedSolver::Impl {
 public:
  explicit Impl(std::shared_ptr<const ChainBatches> structure)
      : shared_(std::move(structure)),
        structure_(*shared_),
        joints_(structure_.joints(), find_couplings(structure_, coupling_of_)),
        incidence_(find_ends(structure_)),
        factor_(structure_.factor_lanes()),
        terminals_(structure_.batches().size() * 2 * kTerminalLanes),
        weights_(structure_.work_lanes()),
        shift_(structure_.work_lanes()),
        keep_(structure_.work_lanes()),
        work_(structure_.work_lanes()),
        joint_weights_(Eigen::VectorXd::Ones(kJointSize * structure_.joints())),
        joint_keep_(Eigen::VectorXd::Ones(kJointSize * structure_.joints())),
        batch_pinned_(structure_.batches().size(), 0),
        counts_(structure_.batches().size()),
        end_blocks_(structure_.chains().size() * 2 * kBlockEntries, 0.0),
        end_vectors_(structure_.chains().size() * 2 * kJointSize, 0.0) {
    weights_.fill(1);
    keep_.fill(1);
  }

  [[nodiscard]] const ChainBatches& structure() const { return structure_; }

  void set_pinned(const std::vector<int>& unknowns) {
    if (unknowns == pinned_) return;
    Eigen::VectorXd keep = Eigen::VectorXd::Ones(structure_.size());
    for (const int unknown : unknowns) {
      if (unknown < 0 || unknown >= structure_.size()) {
        throw Error(ErrorCode::kOutOfRange, "unknowns",
                    fmt::format("unknown {} of {} (from 0)", unknown, structure_.size()));
      }
      keep[unknown] = 0;
    }
    any_joint_pinned_ = joint_keep_.size() > 0 && keep.tail(joint_keep_.size()).minCoeff() == 0;
    joint_keep_ = keep.tail(joint_keep_.size());
    gather_all(keep, keep_);
    for (std::size_t b = 0; b < structure_.batches().size(); ++b) {
      batch_pinned_[b] = 0;
      for (const int chain : structure_.batches()[b].chains) {
        if (chain < 0) continue;
        const auto own = keep.segment(structure_.chain_begin(chain), structure_.chain_size(chain));
        if (own.size() > 0 && own.minCoeff() == 0) batch_pinned_[b] = 1;
      }
    }
    pinned_ = unknowns;
  }

  void set_weights(const Eigen::Ref<const Eigen::VectorXd>& weights) {
    if (weights.size() != structure_.size() || !weights.allFinite() ||
        (weights.size() > 0 && weights.minCoeff() < 0)) {
      throw Error(ErrorCode::kInvalidArgument, "weights",
                  fmt::format("{} finite numbers >= 0 are needed", structure_.size()));
    }
    joint_weights_ = weights.tail(joint_weights_.size());
    gather_all(weights, weights_);
  }

  PivotCount factor(const CondensedMatrix& matrix, double shift) {
    LIMBER_DEMAND(matrix.shared_structure() == shared_);
    parallel_for(static_cast<std::int64_t>(structure_.batches().size()), detail::kBatchesPerChunk,
                 [&](std::int64_t begin, std::int64_t end) {
                   for (std::int64_t b = begin; b < end; ++b)
                     condense(matrix, static_cast<int>(b), shift);
                 });
    parallel_for(structure_.joints(), detail::kJointsPerChunk,
                 [&](std::int64_t begin, std::int64_t end) {
                   for (std::int64_t j = begin; j < end; ++j)
                     assemble_joint(matrix, static_cast<int>(j), shift);
                 });
    pivots_ = joints_.factor();
    for (const PivotCount& count : counts_) pivots_ += count;
    factored_ = true;
    return pivots_;
  }

  void solve(double* x) {
    LIMBER_DEMAND(factored_);
    // Constraints on joints load no chain.
    const double* const joints = x + structure_.joint_begin(0);
    const bool loaded =
        std::any_of(static_cast<const double*>(x), joints, [](double value) { return value != 0; });
    if (loaded) eliminate(x);
    joints_.solve_in_place(x + structure_.joint_begin(0));
    for_batches([&](int batch) {
      if (!loaded) unload(batch);
      backward(batch, x);
    });
  }

  /// Leaves the start of backward().
  void eliminate(double* x) {
    LIMBER_DEMAND(factored_);
    for_batches([&](int batch) { forward(batch, x); });
    double* const joints = x + structure_.joint_begin(0);
    for (int j = 0; j < structure_.joints(); ++j) {
      for (int k = incidence_.begin[j]; k < incidence_.begin[j + 1]; ++k) {
        const double* const received = end_vectors_.data() + incidence_.ends[k] * kJointSize;
        for (int i = 0; i < kJointSize; ++i) joints[j * kJointSize + i] += received[i];
      }
    }
  }

  void substitute(double* x) {
    LIMBER_DEMAND(factored_);
    for_batches([&](int batch) {
      forward(batch, x);
      backward(batch, x);
    });
  }

  [[nodiscard]] const double* joint_block(int joint) {
    LIMBER_DEMAND(factored_);
    return joints_.diagonal(joint);
  }
  [[nodiscard]] const double* coupling_block(int chain) {
    LIMBER_DEMAND(factored_ && coupling_of_[chain] >= 0);
    return joints_.coupling(coupling_of_[chain]);
  }

  PivotCount pivots_;

 private:
  template <class Work>
  void for_batches(const Work& work) const {
    parallel_for(static_cast<std::int64_t>(structure_.batches().size()), kBatchesPerSolveChunk,
                 [&](std::int64_t begin, std::int64_t end) {
                   for (std::int64_t b = begin; b < end; ++b) work(static_cast<int>(b));
                 });
  }

  void gather(const ChainBatch& batch, const double* x, Lanes* numbers) const {
    const double* own[kChainLanes];
    rows_of(batch, own, [&](int chain) { return x + structure_.chain_begin(chain); });
    detail::gather_rows(own, batch.end() - batch.begin(), numbers + batch.begin());
  }

  /// Data of each chain of a batch, null for empty lanes.
  template <class Number, class OfChain>
  static void rows_of(const ChainBatch& batch, Number* (&rows)[kChainLanes],
                      const OfChain& of_chain) {
    for (int lane = 0; lane < kChainLanes; ++lane)
      rows[lane] = batch.chains[lane] < 0 ? nullptr : of_chain(batch.chains[lane]);
  }

  void gather_all(const Eigen::VectorXd& x, LaneBuffer& numbers) const {
    for (const ChainBatch& batch : structure_.batches())
      gather(batch, x.data(), numbers.data() + batch.work);
  }

  [[nodiscard]] Lanes* own_terminal(int batch, int end) {
    return terminals_.data() + (static_cast<std::ptrdiff_t>(batch) * 2 + end) * kTerminalLanes;
  }

  /// Joint of a lane's end, -1 for empty lanes too.
  [[nodiscard]] int joint_at(const ChainBatch& batch, int lane, int end) const {
    if (batch.chains[lane] < 0) return -1;
    const Chain& chain = structure_.chains()[batch.chains[lane]];
    return end == 0 ? chain.start_joint : chain.finish_joint;
  }

  /// Copies J of one end, without the columns of pinned unknowns.
  void take_terminal(const CondensedMatrix& matrix, int index, int end) {
    Lanes* const own = own_terminal(index, end);
    const double* const values = matrix.terminal(index, end);
    std::copy_n(reinterpret_cast<const Lanes*>(values), kTerminalLanes, own);
    if (!any_joint_pinned_) return;
    const ChainBatch& batch = structure_.batches()[index];
    for (int lane = 0; lane < kChainLanes; ++lane) {
      const int joint = joint_at(batch, lane, end);
      if (joint < 0) continue;
      for (int column = 0; column < kJointSize; ++column) {
        if (joint_keep_[joint * kJointSize + column] != 0) continue;
        for (int row = 0; row < kTerminalSize; ++row) own[row * kJointSize + column][lane] = 0;
      }
    }
  }

  void condense(const CondensedMatrix& matrix, int index, double shift) {
    const ChainBatch& batch = structure_.batches()[index];
    ChainAdjustment adjustment;
    if (shift != 0) {
      for (int i = batch.begin(); i < batch.end(); ++i)
        shift_.data()[batch.work + i] = shift * weights_.data()[batch.work + i];
      adjustment.shift = shift_.data() + batch.work;
    }
    if (batch_pinned_[index] != 0) adjustment.keep = keep_.data() + batch.work;
    ChainRemainder remainder;
    counts_[index] =
        detail::eliminate_chains(batch, reinterpret_cast<const Lanes*>(matrix.band(index)),
                                 adjustment, factor_.data() + batch.factor, remainder);

    BlockLanes block;
    for (const int end : {0, 1}) {
      if (!(end == 0 ? batch.has_start : batch.has_finish)) continue;
      take_terminal(matrix, index, end);
      detail::transform_own(remainder.entries, end == 0 ? kTerminalSize : 0,
                            own_terminal(index, end), block);
      for (int c = 0; c < kJointSize; ++c) {
        const std::ptrdiff_t diagonal = c * (kJointSize + 1);
        double* columns[kChainLanes];
        rows_of(batch, columns, [&](int chain) {
          return end_blocks_.data() + (2 * chain + end) * kBlockEntries + diagonal;
        });
        detail::scatter_rows(block + diagonal, static_cast<int>(kJointSize) - c, columns);
      }
    }
    if (!batch.has_start || !batch.has_finish) return;
    detail::transform_coupling(remainder.entries, kTerminalSize, own_terminal(index, 0),
                               own_terminal(index, 1), block);
    double* couplings[kChainLanes];
    rows_of(batch, couplings, [&](int chain) { return joints_.coupling(coupling_of_[chain]); });
    detail::scatter_rows(block, kBlockEntries, couplings);
  }

  void assemble_joint(const CondensedMatrix& matrix, int joint, double shift) {
    double* const block = joints_.diagonal(joint);
    std::copy_n(matrix.joint(joint), kBlockEntries, block);
    const double* const keep = joint_keep_.data() + joint * kJointSize;
    if (any_joint_pinned_) {
      for (int k = 0; k < kBlockEntries; ++k)
        block[k] *= keep[k % kJointSize] * keep[k / kJointSize];
    }
    for (int k = incidence_.begin[joint]; k < incidence_.begin[joint + 1]; ++k) {
      const double* const received = end_blocks_.data() + incidence_.ends[k] * kBlockEntries;
      for (int i = 0; i < kBlockEntries; ++i) block[i] += received[i];
    }
    for (int i = 0; i < kJointSize; ++i) {
      double& diagonal = block[i * (kJointSize + 1)];
      diagonal += shift * joint_weights_[joint * kJointSize + i];
      if (keep[i] == 0) diagonal = 1;
    }
  }

  /// @returns the batch's numbers, all zero
  Lanes* unload(int index) {
    const ChainBatch& batch = structure_.batches()[index];
    Lanes* const numbers = work_.data() + batch.work;
    std::fill_n(numbers, batch.numbers() + 1 + kTerminalSize, Lanes{});
    return numbers;
  }

  void forward(int index, const double* x) {
    const ChainBatch& batch = structure_.batches()[index];
    Lanes* const numbers = unload(index);
    gather(batch, x, numbers);
    detail::substitute_forward(batch, factor_.data() + batch.factor, numbers);
    for (const int end : {0, 1}) {
      if (!(end == 0 ? batch.has_start : batch.has_finish)) continue;
      const Lanes* const received = numbers + (end == 0 ? 0 : batch.end());
      const Lanes* const terminal = own_terminal(index, end);
      Lanes sums[kJointSize] = {};
      for (int row = 0; row < kTerminalSize; ++row) {
        for (int k = 0; k < kJointSize; ++k)
          sums[k] += terminal[row * kJointSize + k] * received[row];
      }
      double* vectors[kChainLanes];
      rows_of(batch, vectors,
              [&](int chain) { return end_vectors_.data() + (2 * chain + end) * kJointSize; });
      detail::scatter_rows(sums, kJointSize, vectors);
    }
  }

  void backward(int index, double* x) {
    const ChainBatch& batch = structure_.batches()[index];
    Lanes* const numbers = work_.data() + batch.work;
    for (const int end : {0, 1}) {
      if (!(end == 0 ? batch.has_start : batch.has_finish)) continue;
      const double* at_joints[kChainLanes];
      for (int lane = 0; lane < kChainLanes; ++lane) {
        const int joint = joint_at(batch, lane, end);
        at_joints[lane] = joint < 0 ? nullptr : x + structure_.joint_begin(joint);
      }
      Lanes unknowns[kJointSize];
      detail::gather_rows(at_joints, kJointSize, unknowns);
      const Lanes* const terminal = own_terminal(index, end);
      Lanes* const given = numbers + (end == 0 ? 0 : batch.end());
      for (int row = 0; row < kTerminalSize; ++row) {
        Lanes sum = {};
        for (int k = 0; k < kJointSize; ++k) sum += terminal[row * kJointSize + k] * unknowns[k];
        given[row] = sum;
      }
    }
    detail::substitute_backward(batch, factor_.data() + batch.factor, numbers);
    double* own[kChainLanes];
    rows_of(batch, own, [&](int chain) { return x + structure_.chain_begin(chain); });
    detail::scatter_rows(numbers + batch.begin(), batch.end() - batch.begin(), own);
  }

  std::shared_ptr<const ChainBatches> shared_;
  const ChainBatches& structure_;
  std::vector<int> coupling_of_;  // edge of the joint system, by chain
  BlockLdlt joints_;
  Incidence incidence_;
  LaneBuffer factor_;                         // by batch
  LaneBuffer terminals_;                      // J as factored, by batch and end
  LaneBuffer weights_, shift_, keep_, work_;  // by batch and number
  Eigen::VectorXd joint_weights_, joint_keep_;
  std::vector<int> pinned_;
  std::vector<char> batch_pinned_;
  std::vector<PivotCount> counts_;
  std::vector<double> end_blocks_;   // 9 x 9 of each chain end
  std::vector<double> end_vectors_;  // 9 of each chain end
  bool any_joint_pinned_ = false;
  bool factored_ = false;
};

CondensedSolver::CondensedSolver(std::shared_ptr<const ChainBatches> structure)
    : impl_(std::make_unique<Impl>(std::move(structure))) {}
CondensedSolver::~CondensedSolver() = default;
CondensedSolver::CondensedSolver(CondensedSolver&&) noexcept = default;
CondensedSolver& CondensedSolver::operator=(CondensedSolver&&) noexcept = default;

int CondensedSolver::size() const { return impl_->structure().size(); }
void CondensedSolver::set_pinned(const std::vector<int>& unknowns) { impl_->set_pinned(unknowns); }
void CondensedSolver::set_shift_weights(const Eigen::Ref<const Eigen::VectorXd>& weights) {
  impl_->set_weights(weights);
}
PivotCount CondensedSolver::factor(const CondensedMatrix& matrix, double shift) {
  return impl_->factor(matrix, shift);
}
void CondensedSolver::solve_in_place(Eigen::Ref<Eigen::VectorXd> x) {
  LIMBER_DEMAND(x.size() == size());
  impl_->solve(x.data());
}
void CondensedSolver::eliminate_chains(Eigen::Ref<Eigen::VectorXd> x) {
  LIMBER_DEMAND(x.size() == size());
  impl_->eliminate(x.data());
}
void CondensedSolver::substitute_chains(Eigen::Ref<Eigen::VectorXd> x) {
  LIMBER_DEMAND(x.size() == size());
  impl_->substitute(x.data());
}
const double* CondensedSolver::condensed_joint(int joint) const {
  return impl_->joint_block(joint);
}
const double* CondensedSolver::condensed_coupling(int chain) const {
  return impl_->coupling_block(chain);
}
const PivotCount& CondensedSolver::pivots() const { return impl_->pivots_; }

}  // namespace limber::rods
