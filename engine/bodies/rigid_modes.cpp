#include "engine/bodies/rigid_modes.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "engine/base/error.h"
#include "engine/bodies/gradient_operator.h"

namespace limber::bodies {
namespace {

// Integral of rho x x^T over the body, x = X - centre: per tet m / 20 (sum_a x_a x_a^T + (sum_a
// x_a)(sum_a x_a)^T).
Eigen::Matrix3d second_moment(const TetMesh& mesh, const Eigen::VectorXd& volumes,
                              const Eigen::Vector3d& centre) {
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (int e = 0; e < mesh.tet_count(); ++e) {
    Eigen::Matrix3d local = Eigen::Matrix3d::Zero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int a = 0; a < 4; ++a) {
      const Eigen::Vector3d x = mesh.nodes.col(mesh.tets(a, e)) - centre;
      local += x * x.transpose();
      sum += x;
    }
    moment += mesh.material_of(e).density * volumes[e] / 20 * (local + sum * sum.transpose());
  }
  return moment;
}

}  // namespace

RigidModes rigid_modes(const TetMesh& mesh) {
  const GradientOperator gradient(mesh);
  const Eigen::VectorXd& volumes = gradient.volumes();
  RigidModes result;
  // Sums are taken about a node of the body: far from the origin, absolute coordinates would lose
  // digits.
  const Eigen::Vector3d origin = mesh.nodes.col(0);
  for (int e = 0; e < mesh.tet_count(); ++e) {
    const double mass = mesh.material_of(e).density * volumes[e];
    result.mass += mass;
    for (int a = 0; a < 4; ++a) {
      result.centre += mass / 4 * (mesh.nodes.col(mesh.tets(a, e)) - origin);
    }
  }
  result.centre = origin + result.centre / result.mass;

  const Eigen::Matrix3d moment = second_moment(mesh, volumes, result.centre);
  result.inertia = moment.trace() * Eigen::Matrix3d::Identity() - moment;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(result.inertia);
  LIMBER_DEMAND(principal.eigenvalues()[0] > 0);
  result.angular = principal.operatorInverseSqrt();

  result.modes.setZero(3 * mesh.node_count(), 6);
  for (int node = 0; node < mesh.node_count(); ++node) {
    const Eigen::Vector3d arm = mesh.nodes.col(node) - result.centre;
    for (int axis = 0; axis < 3; ++axis) {
      result.modes(3 * node + axis, axis) = 1 / std::sqrt(result.mass);
      result.modes.block<3, 1>(3 * node, 3 + axis) = result.angular.col(axis).cross(arm);
    }
  }
  return result;
}

}  // namespace limber::bodies
