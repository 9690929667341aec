#include "engine/beams/solver/load_path.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>

#include "engine/base/rotations/logarithm.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams::detail {

namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

constexpr double kSameAttitude = 1e-6;  // [rad]

}  // namespace

LoadPath::LoadPath(const BeamStructure& structure, const BeamState& start,
                   const std::vector<HeldTurn>& turned)
    : structure_(structure), last_(NodeLoads::of(structure.model())) {
  const BeamModel& model = structure.model();
  std::map<int, Held> held;
  const auto at = [&](int node) -> Held& {
    const auto [place, fresh] = held.try_emplace(node);
    Held& h = place->second;
    if (fresh) {
      h.node = node;
      h.from = start.positions.col(node);
      h.to = model.nodes[index(node)].position;
      h.turned = start.rotations[index(node)];
      h.turn_from.setZero();
      h.turn_to.setZero();
    }
    return h;
  };
  // Rotation vectors go on from where they are known to be: they may be of more than half a turn.
  std::map<int, Eigen::Vector3d> known;
  for (const HeldTurn& t : turned) known[t.node] = t.rotation;
  const auto turn_to = [&](Held& h, const Eigen::Vector3d& rotation) {
    h.turns = true;
    const auto found = known.find(h.node);
    const Eigen::Vector3d from =
        found == known.end() ? Eigen::Vector3d::Zero().eval() : found->second;
    if (rotation_by(from).angularDistance(h.turned) < kSameAttitude) {
      h.turned.setIdentity();
      h.turn_from = from;
      h.turn_to = rotation;
      return;
    }
    h.turn_to = rotations::logarithm((rotation_by(rotation) * h.turned.conjugate()).normalized());
  };
  for (const BeamSupport& s : model.supports) {
    Held& h = at(s.node);
    for (std::size_t k = 0; k < 3; ++k) h.axes[k] = s.fixed[k];
    if (s.fixed[3] && s.fixed[4] && s.fixed[5]) turn_to(h, Eigen::Vector3d::Zero());
  }
  for (const PrescribedMotion& m : model.motions) {
    Held& h = at(m.node);
    for (int k = 0; k < 3; ++k) {
      if (!m.translates[index(k)]) continue;
      h.axes[index(k)] = true;
      h.to[k] += m.translation[k];
    }
    if (m.rotates) turn_to(h, m.rotation);
  }
  for (const auto& [node, h] : held) {
    held_.push_back(h);
    varies_ = varies_ || h.turn_from != h.turn_to || h.from != h.to;
  }
}

LoadPath LoadPath::from_drawn(const BeamStructure& structure) {
  LoadPath path(structure, structure.rest_state(), {});
  path.first_ = path.temporary_ = NodeLoads::temporary(structure.model());
  path.nudged_ = !path.temporary_.empty();
  path.varies_ = path.varies_ || path.nudged_ || !path.last_.empty();
  return path;
}

LoadPath LoadPath::at_once(const BeamStructure& structure, const BeamState& start) {
  LoadPath path(structure, start, {});
  path.first_ = path.last_;
  return path;
}

LoadPath LoadPath::following(const BeamStructure& structure, const BeamState& start,
                             const std::vector<HeldTurn>& turned) {
  LoadPath path(structure, start, turned);
  const Eigen::VectorXd missing =
      elastic_gradient(structure, start) - load_vector(structure, path.last_, start);
  path.first_ = path.last_;
  for (int i = 0; i < structure.nodes(); ++i) {
    // What is held gets from supports whatever it needs.
    Eigen::Matrix<double, 6, 1> wanted = missing.segment<6>(6 * i);
    for (int k = 0; k < 6; ++k)
      if (structure.held()[index(6 * i + k)] != 0) wanted[k] = 0;
    path.first_.forces.col(i) += structure.node_axes(i) * wanted.head<3>();
    path.first_.moments.col(i) += structure.node_axes(i) * wanted.tail<3>();
  }
  path.varies_ = true;
  path.temporary_ = NodeLoads::temporary(structure.model());
  path.nudged_ = !path.temporary_.empty();
  if (path.nudged_) path.first_ = path.first_ + path.temporary_;
  return path;
}

LoadPath LoadPath::resting_at(double s) const {
  LoadPath path = *this;
  path.first_ = path.last_ = loads(s);
  path.nudged_ = false;
  for (Held& h : path.held_) {
    h.from = h.to = h.from + s * (h.to - h.from);
    h.turn_from = h.turn_to = h.turn_from + s * (h.turn_to - h.turn_from);
  }
  return path;
}

LoadPath LoadPath::pushed() const {
  LoadPath path = *this;
  if (nudged_) path.last_ = last_ + temporary_;
  const Eigen::Vector3d common = common_move();
  for (Held& h : path.held_) h.from += common;
  return path;
}

LoadPath LoadPath::let_go() const {
  LoadPath path = resting_at(1);
  if (nudged_) path.first_ = last_ + temporary_;
  path.varies_ = nudged_;
  return path;
}

Eigen::Vector3d LoadPath::common_move() const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  for (const Held& h : held_) {
    for (int k = 0; k < 3; ++k) {
      if (!h.axes[index(k)]) continue;
      const Eigen::Vector3d axis = structure_.node_axes(h.node).col(k);
      sum += axis * axis.transpose();
      moved += axis.dot(h.to - h.from) * axis;
    }
  }
  // Where nothing is held along a direction, nothing goes along it.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
  Eigen::Vector3d common = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (solver.eigenvalues()[k] <= 1e-9 * solver.eigenvalues()[2]) continue;
    const Eigen::Vector3d axis = solver.eigenvectors().col(k);
    common += axis.dot(moved) / solver.eigenvalues()[k] * axis;
  }
  return common;
}

double LoadPath::nudge_work(const BeamState& start, const BeamState& state) const {
  if (!nudged_) return 0;
  const NodeLoads& t = temporary_;
  const Eigen::Vector3d common = common_move();
  double work = 0;
  for (int i = 0; i < structure_.nodes(); ++i) {
    const Eigen::Quaterniond& from = start.rotations[index(i)];
    const Eigen::Vector3d force = t.forces.col(i) + from * t.following_forces.col(i);
    const Eigen::Vector3d moment = t.moments.col(i) + from * t.following_moments.col(i);
    work += force.dot(state.positions.col(i) - start.positions.col(i) - common);
    if (moment.isZero(0)) continue;
    const Eigen::Quaterniond turned = state.rotations[index(i)] * from.conjugate();
    work += moment.dot(rotations::logarithm(turned.normalized()));
  }
  return work;
}

double LoadPath::turn() const {
  double most = 0;
  for (const Held& h : held_) most = std::max(most, (h.turn_to - h.turn_from).norm());
  return most;
}

NodeLoads LoadPath::loads(double s) const { return first_ * (1 - s) + last_ * s; }

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
    const Eigen::Quaterniond turned =
        rotation_by(h.turn_from + s * (h.turn_to - h.turn_from)) * h.turned;
    const Eigen::Quaterniond rest = turned * state.rotations[index(h.node)].conjugate();
    result.segment<3>(6 * h.node + 3) = axes.transpose() * rotations::logarithm(rest.normalized());
  }
  return result;
}

}  // namespace limber::beams::detail
