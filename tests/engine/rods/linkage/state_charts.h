#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tests/support/dense.h"

#include "engine/base/random.h"
#include "engine/base/rotations/exponential_map.h"
#include "engine/base/rotations/logarithm.h"
#include "engine/rods/linkage/linkage_model.h"
#include "engine/rods/linkage/linkage_state.h"

namespace limber::rods::testing {

inline Eigen::VectorXd random_increment(Eigen::Index size, double amount, Random& random) {
  return Eigen::VectorXd::NullaryExpr(size, [&] { return random.uniform(-amount, amount); });
}

inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// How exp(w + dw) turns against exp(w): the left Jacobian of the rotation group as its series.
inline Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w) {
  Eigen::Matrix3d term = Eigen::Matrix3d::Identity(), sum = term;
  for (int k = 1; k < 30; ++k) {
    term = term * skew(w) / (k + 1);
    sum += term;
  }
  return sum;
}

/// Derivatives counted from `base` at its increment x, from those counted from the moved state.
/// Between the two lie the rotations of joints and what the transport from base to moved frames
/// turns free edges.
inline Eigen::VectorXd pulled_back(const LinkageModel& model, const LinkageState& base,
                                   const Eigen::VectorXd& x, const LinkageState& moved,
                                   Eigen::VectorXd gradient) {
  const ReducedVariables& variables = model.variables();
  Eigen::VectorXd spins = Eigen::VectorXd::Zero(gradient.size());
  std::vector<Eigen::Matrix<double, kTerminalNumbers, 1>> ends(
      2 * static_cast<std::size_t>(variables.segments()),
      Eigen::Matrix<double, kTerminalNumbers, 1>::Zero());
  for (int s = 0; s < variables.segments(); ++s) {
    const int edges = variables.edges(s);
    for (int e = 0; e < edges; ++e) {
      if (variables.angle(s, e) < 0) continue;
      const Eigen::Vector3d from =
          (base.vertex(model, s, e + 1) - base.vertex(model, s, e)).normalized();
      const Eigen::Vector3d edge = moved.vertex(model, s, e + 1) - moved.vertex(model, s, e);
      const Eigen::Vector3d to = edge.normalized();
      const Eigen::Vector3d pull =
          -gradient[variables.angle(s, e)] / edge.norm() / (1 + from.dot(to)) * from.cross(to);
      for (const int end : {0, 1}) {
        const Eigen::Vector3d force = end == 0 ? Eigen::Vector3d(-pull) : pull;
        const int at = variables.position(s, e + end);
        if (at >= 0) {
          spins.segment<3>(at) += force;
        } else {
          const bool start = e + end <= 1 && model.graph().segments[s].joints[kStart] >= 0;
          const int first = start ? 0 : edges - 1;
          ends[2 * s + (start ? 0 : 1)].segment<3>(e + end == first ? 0 : 4) += force;
        }
      }
    }
    for (const End end : {kStart, kFinish}) {
      const Segment& segment = model.graph().segments[s];
      const int joint = segment.joints[end];
      if (joint < 0) continue;
      spins.segment<kJointUnknowns>(variables.joint_begin(joint)) +=
          terminal_jacobian(
              terminal_edge_source(moved.joints()[joint], segment.rods[end], segment.signs[end]))
              .transpose() *
          ends[2 * s + end];
    }
  }
  gradient += spins;
  for (int j = 0; j < variables.joints(); ++j) {
    const int at = variables.joint_begin(j) + kJointRotation;
    gradient.segment<3>(at) =
        (left_jacobian(x.segment<3>(at)).transpose() * gradient.segment<3>(at)).eval();
  }
  return gradient;
}

/// The increment that moves a state by a rotation about the origin [rad, below pi] and a shift.
inline Eigen::VectorXd rigid_increment(const LinkageModel& model, const LinkageState& state,
                                       const Eigen::Vector3d& turn, const Eigen::Vector3d& shift) {
  const ReducedVariables& variables = model.variables();
  const Eigen::Matrix3d rotation = rotations::exponential(turn);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(variables.size());
  for (int s = 0; s < variables.segments(); ++s) {
    for (int i = 0; i <= variables.edges(s); ++i) {
      const Eigen::Vector3d place = state.vertex(model, s, i);
      const int at = variables.position(s, i);
      if (at >= 0) x.segment<3>(at) = rotation * place + shift - place;
      if (i == variables.edges(s) || variables.angle(s, i) < 0) continue;
      const Eigen::Vector3d from = (state.vertex(model, s, i + 1) - place).normalized();
      const Eigen::Vector3d to = rotation * from, director = state.director(model, s, i);
      const Eigen::Vector3d carried = reference::rotation_between(from, to) * director;
      const Eigen::Vector3d wanted = rotation * director;
      x[variables.angle(s, i)] = std::atan2(to.dot(carried.cross(wanted)), carried.dot(wanted));
    }
  }
  for (int j = 0; j < variables.joints(); ++j) {
    const Eigen::Vector3d place = state.joints()[j].position;
    x.segment<3>(variables.joint_begin(j)) = rotation * place + shift - place;
    x.segment<3>(variables.joint_begin(j) + kJointRotation) = turn;
  }
  return x;
}

}  // namespace limber::rods::testing
