#include "engine/beams/solver/load_path.h"

#include <algorithm>
#include <map>

#include "engine/base/rotations/logarithm.h"

namespace limber::beams::detail {

namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

LoadPath::LoadPath(const BeamStructure& structure, const BeamState& start, bool as_drawn)
    : structure_(structure),
      loads_(NodeLoads::of(structure.model())),
      temporary_(NodeLoads::temporary(structure.model())),
      as_drawn_(as_drawn) {
  const BeamModel& model = structure.model();
  std::map<int, Held> held;
  const auto at = [&](int node) -> Held& {
    const auto [place, fresh] = held.try_emplace(node);
    Held& h = place->second;
    if (fresh) {
      h.node = node;
      h.from = start.positions.col(node);
      h.to = model.nodes[index(node)].position;
      h.turned_from = start.rotations[index(node)];
      h.rotation.setZero();
    }
    return h;
  };
  for (const BeamSupport& s : model.supports) {
    Held& h = at(s.node);
    for (std::size_t k = 0; k < 3; ++k) h.axes[k] = s.fixed[k];
    h.turns = s.fixed[3] && s.fixed[4] && s.fixed[5];
    if (h.turns) h.rotation = rotations::logarithm(h.turned_from.conjugate());
  }
  for (const PrescribedMotion& m : model.motions) {
    Held& h = at(m.node);
    for (int k = 0; k < 3; ++k) {
      if (!m.translates[index(k)]) continue;
      h.axes[index(k)] = true;
      h.to[k] += m.translation[k];
    }
    if (!m.rotates) continue;
    h.turns = true;
    h.rotation = as_drawn ? m.rotation
                          : rotations::logarithm(
                                (rotation_by(m.rotation) * h.turned_from.conjugate()).normalized());
  }
  for (const auto& [node, h] : held) {
    held_.push_back(h);
    varies_ = varies_ || !h.rotation.isZero(0) || h.from != h.to;
  }
  nudged_ = as_drawn && !temporary_.empty();
  varies_ = varies_ || nudged_ || (as_drawn && !loads_.empty());
}

double LoadPath::turn() const {
  double most = 0;
  for (const Held& h : held_) most = std::max(most, h.rotation.norm());
  return most;
}

NodeLoads LoadPath::loads(double s) const {
  if (!as_drawn_) return loads_;
  if (nudged_) return loads_ * s + temporary_ * (1 - s);
  return loads_ * s;
}

Eigen::VectorXd LoadPath::held_increments(const BeamState& state, double s) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(structure_.unknowns());
  for (const Held& h : held_) {
    const Eigen::Matrix3d& axes = structure_.node_axes(h.node);
    const Eigen::Vector3d target = h.from + s * (h.to - h.from);
    const Eigen::Vector3d move = axes.transpose() * (target - state.positions.col(h.node));
    for (int k = 0; k < 3; ++k) {
      if (h.axes[index(k)]) result[6 * h.node + k] = move[k];
    }
    if (!h.turns) continue;
    const Eigen::Quaterniond turned = rotation_by(s * h.rotation) * h.turned_from;
    const Eigen::Quaterniond rest = turned * state.rotations[index(h.node)].conjugate();
    result.segment<3>(6 * h.node + 3) = axes.transpose() * rotations::logarithm(rest.normalized());
  }
  return result;
}

}  // namespace limber::beams::detail
