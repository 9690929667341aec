#include "engine/rods/equilibrium/length_system.h"

#include <algorithm>

#include "engine/base/error.h"

namespace limber::rods::detail {
namespace {

constexpr int kB = BlockLdlt::kBlock;  // size of a block: the unknowns of a joint
static_assert(kB == kJointSize);

}  // namespace

LengthSystem::LengthSystem(const LinkageModel& model)
    : model_(model),
      solver_(model.chains()),
      pattern_(length_pattern(model.graph())),
      blocks_(0, {}) {
  make_groups();
  const int joints = model.variables().joints();
  const auto note = [&](int a, int b) {
    if (a == b) return;
    couplings_.try_emplace(std::minmax(a, b), static_cast<int>(couplings_.size()));
  };
  for (const Segment& segment : model.graph().segments)
    if (segment.joints[kStart] >= 0 && segment.joints[kFinish] >= 0)
      note(segment.joints[kStart], segment.joints[kFinish]);
  for (std::size_t s = 0; s < slots_.size(); ++s) {
    for (const int joint : pattern_.reaches[s].joints) note(joint, slots_[s].node);
    for (const int other : pattern_.reaches[s].lengths) note(slots_[other].node, slots_[s].node);
  }
  std::vector<std::pair<int, int>> edges(couplings_.size());
  for (const auto& [nodes, index] : couplings_) edges[index] = nodes;
  const int nodes = joints + static_cast<int>(filled_.size());
  blocks_ = BlockLdlt(nodes, edges);
  work_.resize(static_cast<std::size_t>(blocks_.size()));
}

/// The lengths of segments that begin at the same joint make a node of the block system.
void LengthSystem::make_groups() {
  const int joints = model_.variables().joints();
  std::vector<int> group_of_joint(static_cast<std::size_t>(joints), -1);
  for (const Segment& segment : model_.graph().segments) {
    const int joint = segment.joints[segment.joints[kStart] >= 0 ? kStart : kFinish];
    int group = joint >= 0 ? group_of_joint[joint] : -1;
    if (group < 0) {
      group = static_cast<int>(filled_.size());
      filled_.push_back(0);
      if (joint >= 0) group_of_joint[joint] = group;
    }
    slots_.push_back({joints + group, filled_[group]++});
    LIMBER_DEMAND(filled_[group] <= kB);
  }
}

void LengthSystem::add(Slot row, Slot column, double value) {
  if (row.node == column.node) {
    if (row.entry >= column.entry)
      blocks_.diagonal(row.node)[column.entry * kB + row.entry] += value;
    return;
  }
  if (row.node > column.node) std::swap(row, column);
  const int edge = couplings_.at({row.node, column.node});
  blocks_.coupling(edge)[column.entry * kB + row.entry] += value;
}

bool LengthSystem::factor(const CondensedMatrix& matrix, const LinkageDerivatives::ByLengths& mixed,
                          double shift, double length_weight, const std::vector<char>& held) {
  if (!solver_.factor(matrix, shift).positive_definite()) return false;
  held_ = held;
  mixed_ = mixed;
  const auto is_free = [&](Eigen::Index, Eigen::Index column, double) {
    return held_[column] == 0;
  };
  mixed_.unknowns.prune(is_free);
  mixed_.lengths.prune([&](Eigen::Index row, Eigen::Index column, double) {
    return held_[row] == 0 && held_[column] == 0;
  });
  for (int node = 0; node < blocks_.nodes(); ++node)
    std::fill_n(blocks_.diagonal(node), BlockLdlt::kEntries, 0.0);
  for (const auto& [nodes, edge] : couplings_)
    std::fill_n(blocks_.coupling(edge), BlockLdlt::kEntries, 0.0);
  fill_joints();
  fill_lengths(shift * length_weight);
  return blocks_.factor().positive_definite();
}

/// Condensed matrix of the joints.
void LengthSystem::fill_joints() {
  for (int j = 0; j < model_.variables().joints(); ++j)
    std::copy_n(solver_.condensed_joint(j), BlockLdlt::kEntries, blocks_.diagonal(j));
  for (int s = 0; s < model_.variables().segments(); ++s) {
    const auto& joints = model_.graph().segments[s].joints;
    if (joints[kStart] < 0 || joints[kFinish] < 0) continue;
    const double* const block = solver_.condensed_coupling(s);
    for (int column = 0; column < kB; ++column)
      for (int row = 0; row < kB; ++row)
        add({joints[kStart], row}, {joints[kFinish], column}, block[column * kB + row]);
  }
}

/// Condensed matrix of the lengths, those of a colour at once.
void LengthSystem::fill_lengths(double shift_of_length) {
  const int joints_begin = model_.variables().joint_begin(0);
  for (const std::vector<int>& colour : pattern_.colours) {
    Eigen::VectorXd at_joints = Eigen::VectorXd::Zero(model_.variables().size());
    for (const int s : colour) at_joints += mixed_.unknowns.col(s);
    Eigen::VectorXd chains = at_joints;
    chains.tail(chains.size() - joints_begin).setZero();
    solver_.eliminate_chains(at_joints);
    solver_.substitute_chains(chains);
    for (const int s : colour) fill_length(s, at_joints, chains, shift_of_length);
  }
  for (std::size_t g = 0; g < filled_.size(); ++g) {
    const int node = model_.variables().joints() + static_cast<int>(g);
    for (int entry = filled_[g]; entry < kB; ++entry) add({node, entry}, {node, entry}, 1);
  }
}

void LengthSystem::fill_length(int segment, const Eigen::VectorXd& at_joints,
                               const Eigen::VectorXd& chains, double shift_of_length) {
  const Slot own = slots_[segment];
  if (held_[segment] != 0) {
    add(own, own, 1);
    return;
  }
  const LengthPattern::Reach& reach = pattern_.reaches[segment];
  for (const int joint : reach.joints)
    for (int k = 0; k < kB; ++k)
      add({joint, k}, own, at_joints[model_.variables().joint_begin(joint) + k]);
  for (const int other : reach.lengths) {
    if (other < segment || held_[other] != 0) continue;
    const double value =
        mixed_.lengths.coeff(other, segment) - mixed_.unknowns.col(other).dot(chains);
    add(slots_[std::max(other, segment)], slots_[std::min(other, segment)], value);
  }
  add(own, own, shift_of_length);
}

void LengthSystem::solve_in_place(LinkageVector& x) {
  const int joints_begin = model_.variables().joint_begin(0);
  const Eigen::Index count = x.unknowns.size() - joints_begin;
  Eigen::VectorXd reduced = x.unknowns, alone = x.unknowns;
  solver_.eliminate_chains(reduced);
  alone.tail(count).setZero();
  solver_.substitute_chains(alone);
  x.lengths -= mixed_.unknowns.transpose() * alone;
  std::fill(work_.begin(), work_.end(), 0.0);
  std::copy_n(reduced.data() + joints_begin, count, work_.data());
  const auto place = [&](std::size_t s) -> double& {
    return work_[std::size_t{kB} * slots_[s].node + slots_[s].entry];
  };
  for (std::size_t s = 0; s < slots_.size(); ++s)
    if (held_[s] == 0) place(s) = x.lengths[static_cast<Eigen::Index>(s)];
  blocks_.solve_in_place(work_.data());
  for (std::size_t s = 0; s < slots_.size(); ++s)
    x.lengths[static_cast<Eigen::Index>(s)] = held_[s] == 0 ? place(s) : 0;
  x.unknowns -= mixed_.unknowns * x.lengths;
  std::copy_n(work_.data(), count, x.unknowns.data() + joints_begin);
  solver_.substitute_chains(x.unknowns);
}

}  // namespace limber::rods::detail
