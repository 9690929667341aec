#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "engine/base/random.h"
#include "engine/bodies/elastic_body.h"

namespace limber::reduced::testing {

inline constexpr double kPi = 3.14159265358979323846;

/// 3n displacements of new positions (3 x n).
inline Eigen::VectorXd displacements(const bodies::ElasticBody& body, const Eigen::Matrix3Xd& x) {
  const Eigen::Matrix3Xd u = x - body.mesh.nodes;
  return Eigen::Map<const Eigen::VectorXd>(u.data(), u.size());
}

inline Eigen::Map<const Eigen::Matrix3Xd> by_node(const Eigen::VectorXd& u) {
  return {u.data(), 3, u.size() / 3};
}

/// Sections turned about the x axis through the middle of the bounding box, in proportion to x:
/// `angle` [rad] at the far end.
inline Eigen::VectorXd twist(const bodies::ElasticBody& body, double angle) {
  const Eigen::Matrix3Xd& rest = body.mesh.nodes;
  const Eigen::Vector3d low = rest.rowwise().minCoeff(), high = rest.rowwise().maxCoeff();
  Eigen::Vector3d middle = 0.5 * (low + high);
  middle.x() = 0;
  Eigen::Matrix3Xd x = rest;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double share = (rest(0, i) - low.x()) / (high.x() - low.x());
    const Eigen::AngleAxisd turn(angle * share, Eigen::Vector3d::UnitX());
    x.col(i) = middle + turn * (rest.col(i) - middle);
  }
  return displacements(body, x);
}

/// A random sum of long waves whose gradient has entries of about `gradient`; zero at x = 0.
inline Eigen::VectorXd smooth_field(const bodies::ElasticBody& body, double gradient,
                                    std::uint64_t seed) {
  Random random(seed);
  const double length = body.length();
  const Eigen::Matrix3Xd& rest = body.mesh.nodes;
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, rest.cols());
  for (int wave = 0; wave < 5; ++wave) {
    Eigen::Vector3d direction, k;
    for (int axis = 0; axis < 3; ++axis) {
      direction[axis] = gradient * random.normal();
      k[axis] = 1.5 * random.normal() / length;
    }
    const double phase = random.uniform(0, 2 * kPi);
    for (Eigen::Index i = 0; i < rest.cols(); ++i) {
      u.col(i) += direction * (rest(0, i) * std::sin(k.dot(rest.col(i)) + phase));
    }
  }
  return Eigen::Map<const Eigen::VectorXd>(u.data(), u.size());
}

/// The body with `u` on it, turned by `turn` about the origin and moved by `shift`.
inline Eigen::VectorXd moved(const bodies::ElasticBody& body, const Eigen::VectorXd& u,
                             const Eigen::Matrix3d& turn, const Eigen::Vector3d& shift) {
  return displacements(body, (turn * (body.mesh.nodes + by_node(u))).colwise() + shift);
}

/// A bar along x spun by `angle` [rad] about z, tilted by `wobble` [rad] to a side that goes round
/// on its own, swinging between bent and straight by as much, and drifting off.
inline Eigen::VectorXd spun(const bodies::ElasticBody& body, double angle, double wobble) {
  const double phase = 0.37 * angle, length = body.mesh.nodes.row(0).maxCoeff();
  Eigen::Matrix3Xd bent = body.mesh.nodes;
  bent.row(2).array() +=
      0.5 * wobble * std::sin(1.3 * angle) * bent.row(0).array().square() / length;
  const Eigen::AngleAxisd tilt(wobble, Eigen::Vector3d(std::cos(phase), std::sin(phase), 0));
  const Eigen::AngleAxisd spin(angle, Eigen::Vector3d::UnitZ());
  return moved(body, displacements(body, bent), (tilt * spin).toRotationMatrix(),
               Eigen::Vector3d(0.1 * angle, 0, 0));
}

}  // namespace limber::reduced::testing
