#include "engine/rods/design/shape_functions.h"

#include <fmt/format.h>

#include <cmath>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

LinkageVector zero(const LinkageModel& model) {
  return {Eigen::VectorXd::Zero(model.variables().size()),
          Eigen::VectorXd::Zero(model.variables().segments())};
}

int position(const LinkageModel& model, int joint) {
  return model.variables().joint_begin(joint) + kJointPosition;
}

/// Parts that are empty are zero.
void add(double weight, const LinkageVector& part, LinkageVector& sum) {
  const auto add_part = [&](const Eigen::VectorXd& from, Eigen::VectorXd& to) {
    if (from.size() == 0) return;
    if (to.size() == 0) {
      to = weight * from;
    } else {
      to += weight * from;
    }
  };
  add_part(part.unknowns, sum.unknowns);
  add_part(part.lengths, sum.lengths);
  add_part(part.edges, sum.edges);
  add_part(part.sections, sum.sections);
}

}  // namespace

double ElasticEnergy::value(const LinkageState& state) { return assembly_.energies(state).total(); }

LinkageVector ElasticEnergy::gradient(const LinkageState& state) {
  return derivatives_.gradient({state});
}

LinkageVector ElasticEnergy::second(const LinkageState& state, const LinkageVector& v) {
  return derivatives_.second({state}, v);
}

Flatness::Flatness(const LinkageModel& model, const Plane& plane) : model_(model), plane_(plane) {
  const double length = plane.normal.norm();
  if (!plane.point.allFinite() || !std::isfinite(length) || length == 0) {
    throw Error(ErrorCode::kInvalidArgument, "plane.normal", "must be finite and have a direction");
  }
  plane_.normal /= length;
}

double Flatness::value(const LinkageState& state) {
  double sum = 0;
  for (const JointState<double>& joint : state.joints())
    sum += std::pow(plane_.normal.dot(joint.position - plane_.point), 2);
  return sum;
}

LinkageVector Flatness::gradient(const LinkageState& state) {
  LinkageVector result = zero(model_);
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const double height = plane_.normal.dot(state.joints()[j].position - plane_.point);
    result.unknowns.segment<3>(position(model_, j)) = 2 * height * plane_.normal;
  }
  return result;
}

LinkageVector Flatness::second(const LinkageState& /*state*/, const LinkageVector& v) {
  LinkageVector result = zero(model_);
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const int at = position(model_, j);
    result.unknowns.segment<3>(at) =
        2 * plane_.normal.dot(v.unknowns.segment<3>(at)) * plane_.normal;
  }
  return result;
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

LinkageVector SmallestAngle::gradient(const LinkageState& state) {
  LinkageVector result = zero(model_);
  const Eigen::VectorXd share = shares(state);
  for (int j = 0; j < model_.variables().joints(); ++j)
    result.unknowns[model_.variables().joint_begin(j) + kJointAngle] = share[j];
  return result;
}

LinkageVector SmallestAngle::second(const LinkageState& state, const LinkageVector& v) {
  LinkageVector result = zero(model_);
  const Eigen::VectorXd share = shares(state);
  const auto unknown = [&](int j) { return model_.variables().joint_begin(j) + kJointAngle; };
  double mean = 0;
  for (int j = 0; j < share.size(); ++j) mean += share[j] * v.unknowns[unknown(j)];
  for (int j = 0; j < share.size(); ++j)
    result.unknowns[unknown(j)] = -sharpness_ * share[j] * (v.unknowns[unknown(j)] - mean);
  return result;
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
    if (!(target.weight >= 0) || !std::isfinite(target.weight)) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("targets[{}].weight", i),
                  fmt::format("must be >= 0 and finite, is {:g}", target.weight));
    }
  }
  if (!(surface_weight >= 0) || !std::isfinite(surface_weight)) {
    throw Error(ErrorCode::kInvalidArgument, "surface_weight",
                fmt::format("must be >= 0 and finite, is {:g}", surface_weight));
  }
  if (surface_weights_.size() == 0) surface_weights_.setOnes(joints);
  if (surface_weights_.size() != joints) {
    throw Error(ErrorCode::kInvalidArgument, "joint_surface_weights",
                fmt::format("must be one for each of {} joints, or none; there are {}", joints,
                            surface_weights_.size()));
  }
  for (int j = 0; j < joints; ++j) {
    if (surface_weights_[j] >= 0 && std::isfinite(surface_weights_[j])) continue;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("joint_surface_weights[{}]", j),
                fmt::format("must be >= 0 and finite, is {:g}", surface_weights_[j]));
  }
  surface_weights_ *= surface_weight;
}

double TargetDistance::value(const LinkageState& state) {
  double sum = 0;
  for (const JointTarget& target : targets_) {
    sum += 0.5 * target.weight *
           (state.joints()[target.joint].position - target.position).squaredNorm();
  }
  if (surface_ == nullptr) return sum;
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const Eigen::Vector3d& x = state.joints()[j].position;
    sum += 0.5 * surface_weights_[j] * (x - surface_->closest(x).position).squaredNorm();
  }
  return sum;
}

LinkageVector TargetDistance::gradient(const LinkageState& state) {
  LinkageVector result = zero(model_);
  for (const JointTarget& target : targets_) {
    result.unknowns.segment<3>(position(model_, target.joint)) +=
        target.weight * (state.joints()[target.joint].position - target.position);
  }
  if (surface_ == nullptr) return result;
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const Eigen::Vector3d& x = state.joints()[j].position;
    // P moves along the surface, across x - P: it adds nothing.
    result.unknowns.segment<3>(position(model_, j)) +=
        surface_weights_[j] * (x - surface_->closest(x).position);
  }
  return result;
}

LinkageVector TargetDistance::second(const LinkageState& state, const LinkageVector& v) {
  LinkageVector result = zero(model_);
  for (const JointTarget& target : targets_) {
    const int at = position(model_, target.joint);
    result.unknowns.segment<3>(at) += target.weight * v.unknowns.segment<3>(at);
  }
  if (surface_ == nullptr) return result;
  for (int j = 0; j < model_.variables().joints(); ++j) {
    const int at = position(model_, j);
    const Eigen::Vector3d move = v.unknowns.segment<3>(at);
    const ClosestPoint closest = surface_->closest(state.joints()[j].position);
    result.unknowns.segment<3>(at) += surface_weights_[j] * (move - closest.derivative * move);
  }
  return result;
}

double SumOfFunctions::value(const LinkageState& state) {
  double sum = 0;
  for (const Term& term : terms_) sum += term.weight * term.function.value(state);
  return sum;
}

LinkageVector SumOfFunctions::gradient(const LinkageState& state) {
  LinkageVector sum;
  for (const Term& term : terms_) add(term.weight, term.function.gradient(state), sum);
  return sum;
}

LinkageVector SumOfFunctions::second(const LinkageState& state, const LinkageVector& v) {
  LinkageVector sum;
  for (const Term& term : terms_) add(term.weight, term.function.second(state, v), sum);
  return sum;
}

}  // namespace limber::rods
