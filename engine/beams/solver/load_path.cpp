#include "engine/beams/solver/load_path.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "engine/base/index.h"
#include "engine/base/rotations/logarithm.h"
#include "engine/beams/structure/elastic.h"

namespace limber::beams::detail {

namespace {

constexpr double kStays = 1e-12;  // [rad]

}  // namespace

LoadPath::LoadPath(const BeamStructure& structure, const BeamState& start,
                   const std::vector<HeldTurn>& turned)
    : structure_(structure), last_(NodeLoads::of(structure.model())) {
  const BeamModel& model = structure.model();
  struct Prescription {
    std::array<bool, 6> held{};
    Eigen::Vector3d move = Eigen::Vector3d::Zero();  // by the node's axes
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  };
  std::map<int, Prescription> prescriptions;
  for (const BeamSupport& s : model.supports) prescriptions[s.node].held = s.fixed;
  for (const PrescribedMotion& given : model.motions) {
    const PrescribedMotion m = structure.motion_by_node_axes(given);
    Prescription& w = prescriptions[m.node];
    w.move = m.translation;
    w.turn = m.rotation;
    for (std::size_t k = 0; k < 3; ++k) {
      w.held[k] = w.held[k] || m.translates[k];
      w.held[3 + k] = w.held[3 + k] || m.rotates[k];
    }
  }
  // Rotation vectors continue from where they are known to be: they may be of more than half a
  // turn.
  std::map<int, Eigen::Vector3d> known;
  for (const HeldTurn& t : turned) known[t.node] = t.rotation;
  for (const auto& [node, w] : prescriptions) {
    const Eigen::Matrix3d& axes = structure.node_axes(node);
    Held h;
    h.node = node;
    h.from = start.positions.col(node);
    h.to = model.nodes[index(node)].position + axes * w.move;
    for (std::size_t k = 0; k < 3; ++k) h.axes[k] = w.held[k];
    std::optional<Eigen::Vector3d> before;
    if (const auto found = known.find(node); found != known.end())
      before = axes.transpose() * found->second;
    h.rotation = HeldRotation({w.held[3], w.held[4], w.held[5]}, axes, start.rotations[index(node)],
                              w.turn, before);
    varies_ = varies_ || h.rotation.angle() > kStays || h.from != h.to;
    held_.push_back(std::move(h));
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
    // Held nodes get from supports all that they need.
    Eigen::Matrix<double, 6, 1> load = missing.segment<6>(6 * i);
    for (int k = 0; k < 6; ++k)
      if (structure.held()[index(6 * i + k)] != 0) load[k] = 0;
    path.first_.forces.col(i) += structure.node_axes(i) * load.head<3>();
    path.first_.moments.col(i) +=
        structure.spin_axes(i, start.rotations[index(i)]) * load.tail<3>();
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
    h.rotation = h.rotation.resting_at(s);
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

LoadPath LoadPath::release() const {
  LoadPath path = resting_at(1);
  if (nudged_) path.first_ = last_ + temporary_;
  path.varies_ = nudged_;
  return path;
}

LoadPath LoadPath::without_temporary_loads() const {
  LoadPath path = *this;
  if (nudged_) path.first_ = first_ + temporary_ * -1;
  path.nudged_ = false;
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
  // If nothing is held along a direction, nothing goes along it.
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
  for (const Held& h : held_) most = std::max(most, h.rotation.angle());
  return most;
}

bool LoadPath::begins_unloaded(double share, double length) const {
  const auto size = [length](const NodeLoads& of) {
    const double forces = std::hypot(of.forces.norm(), of.following_forces.norm());
    const double over_elements =
        std::hypot(of.element_forces.norm(), of.following_element_forces.norm());
    return std::hypot(length * forces, length * over_elements,
                      std::hypot(of.moments.norm(), of.following_moments.norm()));
  };
  return first_.empty() || size(first_) <= share * size(last_);
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
    result.segment<3>(6 * h.node + 3) = h.rotation.spin(state.rotations[index(h.node)], s);
  }
  return result;
}

}  // namespace limber::beams::detail
