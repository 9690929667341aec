#include "engine/reduced/scaled_modes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/bodies/mass.h"

namespace limber::reduced {

Eigen::VectorXd largest_node_displacement(const Eigen::Ref<const Eigen::MatrixXd>& u) {
  Eigen::VectorXd result(u.cols());
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    const Eigen::Map<const Eigen::Matrix3Xd> nodes(u.col(k).data(), 3, u.rows() / 3);
    result[k] = std::sqrt(nodes.colwise().squaredNorm().maxCoeff());
  }
  return result;
}

namespace {

Eigen::Vector3d centre_of_mass(const bodies::ElasticBody& body) {
  const Eigen::VectorXd mass = bodies::lumped_node_mass(body.mesh);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < mass.size(); ++i) sum += mass[i] * body.mesh.nodes.col(i);
  return sum / mass.sum();
}

}  // namespace

Eigen::MatrixXd affine_fields(const bodies::ElasticBody& body) {
  const Eigen::Matrix3Xd& x = body.mesh.nodes;
  const Eigen::Vector3d centre = centre_of_mass(body);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(3 * x.cols(), 12);
  for (Eigen::Index node = 0; node < x.cols(); ++node) {
    for (int i = 0; i < 3; ++i) {
      result(3 * node + i, i) = 1;
      for (int j = 0; j < 3; ++j) result(3 * node + i, 3 + 3 * j + i) = x(j, node) - centre[j];
    }
  }
  return result;
}

ScaledModes scale_modes(const bodies::ElasticBody& body, const bodies::ModalBasis& basis) {
  ScaledModes result{basis.eigenvalues, basis.modes, basis.rigid_count, basis.mechanism_count};
  const int rigid = basis.rigid_count;
  LIMBER_DEMAND(rigid == (body.is_free() ? 6 : 0) && result.count() > rigid);
  const double length = body.length();

  if (rigid > 0) {
    const Eigen::Matrix3Xd& x = body.mesh.nodes;
    const Eigen::Vector3d centre = centre_of_mass(body);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      Eigen::Map<Eigen::Matrix3Xd> shift(result.modes.col(k).data(), 3, x.cols());
      Eigen::Map<Eigen::Matrix3Xd> turn(result.modes.col(3 + k).data(), 3, x.cols());
      shift = (length * axis).replicate(1, x.cols());
      for (Eigen::Index i = 0; i < x.cols(); ++i) turn.col(i) = axis.cross(x.col(i) - centre);
    }
    result.eigenvalues.head(rigid).setZero();
  }

  const int reference = reference_mode(result.count(), rigid, result.mechanism_count);
  const double lowest = result.eigenvalues[reference];
  LIMBER_DEMAND(lowest > 0);
  const double unit = length / largest_node_displacement(result.modes.col(reference))[0];
  for (int k = rigid; k < result.count(); ++k) {
    result.modes.col(k) *= unit / std::sqrt(std::max(1.0, result.eigenvalues[k] / lowest));
  }
  return result;
}

}  // namespace limber::reduced
