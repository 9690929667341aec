#include "engine/rods/equilibrium/holding.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace limber::rods::detail {
namespace {

/// A spring stiffness below this share of the largest holds nothing.
constexpr double kHolds = 1e-9;
/// Share of the stiffness that bends the whole linkage.
constexpr double kWeakStiffness = 1e-2;

using Matrix36 = Eigen::Matrix<double, 3, 6>;

/// How a point moves when the linkage turns rigidly about another: d(point) / d(shift, turn).
Matrix36 rigid_motion(const Eigen::Vector3d& arm) {
  Matrix36 result = Matrix36::Zero();
  result.leftCols<3>().setIdentity();
  for (int axis = 0; axis < 3; ++axis)
    result.col(3 + axis) = Eigen::Vector3d::Unit(axis).cross(arm);
  return result;
}

}  // namespace

std::vector<int> lengths_on_their_bound(const LinkageModel& model, const LinkageState& state,
                                        const Eigen::VectorXd& gradient, double shortest) {
  std::vector<int> bounded;
  for (int j = 0; j < model.variables().joints(); ++j) {
    for (const RodOfJoint rod : {kRodA, kRodB}) {
      const int unknown = model.variables().joint_begin(j) + kJointLengthA + rod;
      const double least = shortest * model.rest_lengths().terminal(rod, j);
      const bool there = state.joints()[j].lengths[rod] <= least * (1 + 1e-12);
      if (there && gradient[unknown] > 0) bounded.push_back(unknown);
    }
  }
  return bounded;
}

SpringHold::SpringHold(const LinkageModel& model, const ConditionTerms& terms,
                       const LinkageState& state, int component, const Eigen::Vector3d& about,
                       double size) {
  const LinkageGraph& graph = model.graph();
  const std::vector<int> of_joints = joint_components(graph);
  for (const SpringPoint& spring : terms.springs()) {
    const int own =
        spring.joint >= 0 ? of_joints[spring.joint] : graph.segment_components[spring.segment];
    if (own != component) continue;
    touches = true;
    Matrix36 motion = rigid_motion(terms.place(state, spring) - about);
    motion.rightCols<3>() /= size;
    stiffness += spring.stiffness * motion.transpose() * motion;
  }
}

Eigen::Matrix<double, 6, Eigen::Dynamic> SpringHold::unresisted() const {
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(stiffness);
  const auto& values = eigen.eigenvalues();  // ascending
  const auto free = (values.array() <= kHolds * values[5]).count();
  return eigen.eigenvectors().leftCols(free);
}

std::vector<int> joint_components(const LinkageGraph& graph) {
  std::vector<int> result(graph.joints.size(), -1);
  for (std::size_t s = 0; s < graph.segments.size(); ++s) {
    for (const int joint : graph.segments[s].joints)
      if (joint >= 0) result[joint] = graph.segment_components[s];
  }
  return result;
}

Holding::Holding(const LinkageModel& model, const Conditions& conditions,
                 const ConditionTerms& terms, const UnknownScales& scales,
                 const LinkageState& state)
    : model_(model),
      joint_components_(joint_components(model.graph())),
      is_pinned_(static_cast<std::size_t>(model.variables().size()), 0),
      rows_(0, model.variables().size()),
      extent_(scales.extent()) {
  const ReducedVariables& variables = model.variables();
  std::vector<char> held(static_cast<std::size_t>(model.graph().components), 0);
  for (const JointPin& value : conditions.pins) {
    const int begin = variables.joint_begin(value.joint);
    if (value.hold != Hold::kMotion) pin(begin + kJointAngle);
    if (value.hold == Hold::kAngle) continue;
    for (int k = 0; k < 6; ++k) pin(begin + k);
    held[joint_components_[value.joint]] = 1;
    if (!value.position) continue;
    for (int axis = 0; axis < 3; ++axis)
      prescribed_.push_back({begin + axis, value.joint, (*value.position)[axis]});
  }
  for (const AngleSetting& setting : conditions.angles) {
    const int unknown = variables.joint_begin(setting.joint) + kJointAngle;
    pin(unknown);
    prescribed_.push_back({unknown, setting.joint, setting.angle});
  }
  if (conditions.mean_opening_angle) {
    mean_angle_ = *conditions.mean_opening_angle;
    rows_ = Eigen::MatrixXd::Zero(1, variables.size());
    for (int j = 0; j < variables.joints(); ++j) {
      const int unknown = variables.joint_begin(j) + kJointAngle;
      if (!is_pinned(unknown)) rows_(0, unknown) = 1.0 / variables.joints();
    }
  }
  hold_floating(terms, scales, state, std::move(held));
  std::sort(pinned_.begin(), pinned_.end());
}

void Holding::pin(int unknown) {
  if (is_pinned_[unknown] == 0) pinned_.push_back(unknown);
  is_pinned_[unknown] = 1;
}

/// As drawn, so that it is the same joint in every shape: motions that are extrapolated from
/// several shapes would not fit together otherwise.
int Holding::central_joint(int component) const {
  const std::vector<Joint>& drawn = model_.graph().joints;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::size_t j = 0; j < drawn.size(); ++j) {
    if (joint_components_[j] != component) continue;
    sum += drawn[j].position;
    ++count;
  }
  int best = -1;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < drawn.size(); ++j) {
    if (joint_components_[j] != component) continue;
    const double distance = (drawn[j].position - sum / count).norm();
    if (distance < nearest) best = static_cast<int>(j);
    nearest = std::min(nearest, distance);
  }
  return best;
}

void Holding::hold_floating(const ConditionTerms& terms, const UnknownScales& scales,
                            const LinkageState& state, std::vector<char> held) {
  const LinkageGraph& graph = model_.graph();
  const std::vector<ConditionTerms::Resultant> loads = terms.resultants();
  for (int c = 0; c < graph.components; ++c) {
    if (held[c] != 0) continue;
    const int joint = central_joint(c);
    // A single rod without joints is left to the shift.
    if (joint < 0) continue;
    const double size = scales.extent();
    const SpringHold springs(model_, terms, state, c, state.joints()[joint].position, size);
    // Moments alone balance each other.
    if (!springs.touches && !(loads[c].magnitudes > 0)) {
      for (int k = 0; k < 6; ++k) pin(model_.variables().joint_begin(joint) + k);
      continue;
    }
    Matrix6 weak = Matrix6::Zero();
    const auto free = springs.unresisted();
    for (const auto& mode : free.colwise())
      weak += kWeakStiffness * scales.bending() / std::pow(size, 3) * mode * mode.transpose();
    weak.bottomRows<3>() *= size;
    weak.rightCols<3>() *= size;
    if (!weak.isZero(0)) weak_.push_back({joint, weak});
  }
}

Holding::Gap Holding::gap(const LinkageState& state) const {
  Gap result;
  result.pinned = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(is_pinned_.size()));
  double turned = 0;
  for (const Prescribed& value : prescribed_) {
    const JointState<double>& joint = state.joints()[value.joint];
    const int local = value.unknown - model_.variables().joint_begin(value.joint);
    const bool angle = local == kJointAngle;
    const double missing = value.value - (angle ? joint.opening_angle : joint.position[local]);
    result.pinned[value.unknown] = missing;
    if (angle) turned += missing;
    result.size = std::max(result.size, std::abs(missing) / (angle ? 1 : extent_));
  }
  result.rows.resize(rows_.rows());
  if (rows_.rows() == 0) return result;
  const double missing = mean_angle_ - state.mean_opening_angle();
  result.rows[0] = missing - turned / model_.variables().joints();
  result.size = std::max(result.size, std::abs(missing));
  return result;
}

double Holding::remove_reactions(Eigen::Ref<Eigen::VectorXd> gradient) const {
  for (const int unknown : pinned_) gradient[unknown] = 0;
  if (rows_.rows() == 0) return 0;
  const double force = rows_.row(0).dot(gradient) / rows_.row(0).squaredNorm();
  gradient -= force * rows_.row(0).transpose();
  return force;
}

void Holding::add_weak_holds(CondensedMatrix& hessian) const {
  for (const WeakHold& hold : weak_) {
    for (int c = 0; c < 6; ++c) {
      for (int r = 0; r < 6; ++r)
        hessian.joint(hold.joint)[c * kJointUnknowns + r] += hold.stiffness(r, c);
    }
  }
}

}  // namespace limber::rods::detail
