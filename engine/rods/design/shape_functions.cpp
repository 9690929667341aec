#include "engine/rods/design/shape_functions.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/rods/design/design_weight.h"

namespace limber::rods {
namespace {

int position(const LinkageModel& model, int joint) {
  return model.variables().joint_begin(joint) + kJointPosition;
}

/// How a linkage's joints lie about their mean.
class Scatter {
 public:
  explicit Scatter(const LinkageState& state) {
    const auto& joints = state.joints();
    for (const JointState<double>& joint : joints)
      mean_ += joint.position / static_cast<double>(joints.size());
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (const JointState<double>& joint : joints)
      sum += (joint.position - mean_) * (joint.position - mean_).transpose();
    axes_.compute(sum);
  }
  /// Nearest to the joints.
  [[nodiscard]] Plane plane() const { return {mean_, axes_.eigenvectors().col(0)}; }
  /// @param change  of the sum of squares; joints on a line have no normal that would turn
  [[nodiscard]] Eigen::Vector3d turn_of_normal(const Eigen::Matrix3d& change) const {
    constexpr double kNoGap = 1e-12;  // of the largest eigenvalue: smaller gaps count as zero
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    for (int k = 1; k < 3; ++k) {
      const double gap = axes_.eigenvalues()[0] - axes_.eigenvalues()[k];
      if (!(-gap > kNoGap * axes_.eigenvalues()[2])) continue;
      const auto axis = axes_.eigenvectors().col(k);
      turn += axis.dot(change * axes_.eigenvectors().col(0)) / gap * axis;
    }
    return turn;
  }

 private:
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes_;
};

}  // namespace

double ElasticEnergy::value(const LinkageState& state) { return assembly_.energies(state).total(); }

Flatness::Flatness(const LinkageModel& model, const std::optional<Plane>& plane)
    : model_(model), plane_(plane) {
  if (!plane_) return;
  const double length = plane_->normal.norm();
  if (!plane_->point.allFinite() || !std::isfinite(length) || length == 0) {
    throw Error(ErrorCode::kInvalidArgument, "plane.normal", "must be finite and have a direction");
  }
  plane_->normal /= length;
}

Plane Flatness::plane_at(const LinkageState& state) const {
  return plane_ ? *plane_ : Scatter(state).plane();
}

double Flatness::value(const LinkageState& state) {
  const Plane plane = plane_at(state);
  double sum = 0;
  for (const JointState<double>& joint : state.joints())
    sum += std::pow(plane.normal.dot(joint.position - plane.point), 2);
  return sum;
}

void Flatness::add_gradient(const LinkageState& state, double weight,
                            Eigen::Ref<Eigen::VectorXd> by) {
  // That the nearest plane moves does not matter to first order.
  const Plane plane = plane_at(state);
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const double height = plane.normal.dot(state.joints()[j].position - plane.point);
    by.segment<3>(position(model_, j)) += 2 * weight * height * plane.normal;
  }
}

void Flatness::add_second(const LinkageState& state, const Eigen::Ref<const Eigen::VectorXd>& v,
                          double weight, Eigen::Ref<Eigen::VectorXd> by) {
  std::optional<Scatter> scatter;
  if (!plane_) scatter.emplace(state);
  const Plane plane = scatter ? scatter->plane() : *plane_;
  const int joints = model_.variables().joints();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero(), shift = turn;  // of the plane
  if (scatter) {
    for (int j = 0; j < joints; ++j) shift += v.segment<3>(position(model_, j)) / joints;
    Eigen::Matrix3d change = Eigen::Matrix3d::Zero();
    for (int j = 0; j < joints; ++j) {
      const Eigen::Vector3d moved = v.segment<3>(position(model_, j)) - shift;
      const Eigen::Vector3d offset = state.joints()[j].position - plane.point;
      change += moved * offset.transpose() + offset * moved.transpose();
    }
    turn = scatter->turn_of_normal(change);
  }
  for (int j = 0; j < joints; ++j) {
    const int at = position(model_, j);
    const Eigen::Vector3d offset = state.joints()[j].position - plane.point;
    const double height = plane.normal.dot(offset);
    const double rise = plane.normal.dot(v.segment<3>(at) - shift) + turn.dot(offset);
    by.segment<3>(at) += 2 * weight * (rise * plane.normal + height * turn);
  }
}

SmallestAngle::SmallestAngle(const LinkageModel& model, double sharpness)
    : model_(model), sharpness_(sharpness) {
  if (sharpness > 0 && std::isfinite(sharpness)) return;
  throw Error(ErrorCode::kInvalidArgument, "angle_sharpness",
              fmt::format("must be > 0 and finite, is {:g}", sharpness));
}

Eigen::VectorXd SmallestAngle::shares(const LinkageState& state) const {
  Eigen::VectorXd angles(model_.variables().joints());
  for (Eigen::Index j = 0; j < angles.size(); ++j) angles[j] = state.joints()[j].opening_angle;
  const Eigen::VectorXd powers = (sharpness_ * (angles.minCoeff() - angles.array())).exp();
  return powers / powers.sum();
}

double SmallestAngle::value(const LinkageState& state) {
  double least = state.joints()[0].opening_angle;
  for (const JointState<double>& joint : state.joints())
    least = std::min(least, joint.opening_angle);
  double sum = 0;
  for (const JointState<double>& joint : state.joints())
    sum += std::exp(sharpness_ * (least - joint.opening_angle));
  return least - std::log(sum) / sharpness_;
}

void SmallestAngle::add_gradient(const LinkageState& state, double weight,
                                 Eigen::Ref<Eigen::VectorXd> by) {
  const Eigen::VectorXd share = shares(state);
  for (int j = 0; j < model_.variables().joints(); ++j)
    by[model_.variables().joint_begin(j) + kJointAngle] += weight * share[j];
}

void SmallestAngle::add_second(const LinkageState& state,
                               const Eigen::Ref<const Eigen::VectorXd>& v, double weight,
                               Eigen::Ref<Eigen::VectorXd> by) {
  const Eigen::VectorXd share = shares(state);
  const auto unknown = [&](int j) { return model_.variables().joint_begin(j) + kJointAngle; };
  double mean = 0;
  for (int j = 0; j < share.size(); ++j) mean += share[j] * v[unknown(j)];
  for (int j = 0; j < share.size(); ++j)
    by[unknown(j)] -= weight * sharpness_ * share[j] * (v[unknown(j)] - mean);
}

TargetDistance::TargetDistance(const LinkageModel& model, std::vector<JointTarget> targets,
                               const TargetSurface* surface, double surface_weight,
                               Eigen::VectorXd joint_weights)
    : model_(model),
      targets_(std::move(targets)),
      surface_(surface),
      surface_weights_(std::move(joint_weights)) {
  const int joints = model.variables().joints();
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const JointTarget& target = targets_[i];
    if (target.joint < 0 || target.joint >= joints) {
      throw Error(ErrorCode::kOutOfRange, fmt::format("targets[{}].joint", i),
                  fmt::format("joint {} is outside 0 .. {}", target.joint, joints - 1));
    }
    if (!target.position.allFinite()) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("targets[{}].position", i),
                  "must be finite");
    }
    demand_design_weight(fmt::format("targets[{}].weight", i), target.weight);
  }
  demand_design_weight("surface_weight", surface_weight);
  if (surface_weights_.size() == 0) surface_weights_.setOnes(joints);
  if (surface_weights_.size() != joints) {
    throw Error(ErrorCode::kInvalidArgument, "joint_surface_weights",
                fmt::format("must be one for each of {} joints, or none; there are {}", joints,
                            surface_weights_.size()));
  }
  for (int j = 0; j < joints; ++j)
    demand_design_weight(fmt::format("joint_surface_weights[{}]", j), surface_weights_[j]);
  surface_weights_ *= surface_weight;
}

const std::vector<ClosestPoint>& TargetDistance::closest_points(const LinkageState& state) {
  const std::vector<JointState<double>>& joints = state.joints();
  const bool known = std::equal(
      sought_.begin(), sought_.end(), joints.begin(), joints.end(),
      [](const Eigen::Vector3d& x, const JointState<double>& y) { return x == y.position; });
  if (known) return closest_;
  sought_.resize(joints.size());
  closest_.resize(joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    sought_[j] = joints[j].position;
    closest_[j] = surface_->closest(sought_[j]);
  }
  return closest_;
}

double TargetDistance::value(const LinkageState& state) {
  double sum = 0;
  for (const JointTarget& target : targets_) {
    sum += 0.5 * target.weight *
           (state.joints()[target.joint].position - target.position).squaredNorm();
  }
  if (surface_ == nullptr) return sum;
  const std::vector<ClosestPoint>& closest = closest_points(state);
  for (int j = 0; j < model_.variables().joints(); ++j) {
    sum += 0.5 * surface_weights_[j] *
           (state.joints()[j].position - closest[j].position).squaredNorm();
  }
  return sum;
}

void TargetDistance::add_gradient(const LinkageState& state, double weight,
                                  Eigen::Ref<Eigen::VectorXd> by) {
  for (const JointTarget& target : targets_) {
    by.segment<3>(position(model_, target.joint)) +=
        weight * target.weight * (state.joints()[target.joint].position - target.position);
  }
  if (surface_ == nullptr) return;
  const std::vector<ClosestPoint>& closest = closest_points(state);
  for (int j = 0; j < model_.variables().joints(); ++j) {
    // P moves along the surface, across x - P: it adds nothing.
    by.segment<3>(position(model_, j)) +=
        weight * surface_weights_[j] * (state.joints()[j].position - closest[j].position);
  }
}

void TargetDistance::add_second(const LinkageState& state,
                                const Eigen::Ref<const Eigen::VectorXd>& v, double weight,
                                Eigen::Ref<Eigen::VectorXd> by) {
  for (const JointTarget& target : targets_) {
    const int at = position(model_, target.joint);
    by.segment<3>(at) += weight * target.weight * v.segment<3>(at);
  }
  if (surface_ == nullptr) return;
  const std::vector<ClosestPoint>& closest = closest_points(state);
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const int at = position(model_, j);
    const Eigen::Vector3d move = v.segment<3>(at);
    by.segment<3>(at) += weight * surface_weights_[j] * (move - closest[j].derivative * move);
  }
}

double SumOfFunctions::value(const LinkageState& state) {
  double sum = 0;
  for (const Term& term : terms_) sum += term.weight * term.function.value(state);
  return sum;
}

double SumOfFunctions::elastic_share() const {
  double sum = 0;
  for (const Term& term : terms_) sum += term.weight * term.function.elastic_share();
  return sum;
}

void SumOfFunctions::add_gradient(const LinkageState& state, double weight,
                                  Eigen::Ref<Eigen::VectorXd> by) {
  for (const Term& term : terms_) term.function.add_gradient(state, weight * term.weight, by);
}

void SumOfFunctions::add_second(const LinkageState& state,
                                const Eigen::Ref<const Eigen::VectorXd>& v, double weight,
                                Eigen::Ref<Eigen::VectorXd> by) {
  for (const Term& term : terms_) term.function.add_second(state, v, weight * term.weight, by);
}

}  // namespace limber::rods
