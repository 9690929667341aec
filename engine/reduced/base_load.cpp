#include "engine/reduced/base_load.h"

#include <Eigen/LU>

#include "engine/base/parallel.h"
#include "engine/bodies/gradient_operator.h"

namespace limber::reduced {
namespace {

constexpr int kPolarSteps = 12;

/// R of F = R U by Newton's iteration (Higham 1986); the identity for tets that are turned inside
/// out or flat.
Eigen::Matrix3d rotation_of(const Eigen::Matrix3d& gradient) {
  if (!(gradient.determinant() > 0)) return Eigen::Matrix3d::Identity();
  Eigen::Matrix3d rotation = gradient;
  for (int step = 0; step < kPolarSteps; ++step) {
    const Eigen::Matrix3d next = 0.5 * (rotation + rotation.inverse().transpose());
    const double change = (next - rotation).norm();
    rotation = next;
    if (change < 1e-12) break;
  }
  return rotation;
}

}  // namespace

Eigen::MatrixXd BaseLoad::of_modes(const Eigen::MatrixXd& mixing) const {
  const Eigen::VectorXd mixed = mixing.cwiseAbs2().transpose() * masses;
  return mixed.cwiseInverse().asDiagonal() * (mixing.transpose() * forces);
}

BaseLoad base_load(const bodies::ElasticBody& body, const Eigen::MatrixXd& modes, int free_modes,
                   const Eigen::Ref<const Eigen::MatrixXd>& displacements) {
  const bodies::GradientOperator gradient(body.mesh);
  const Eigen::Index frames = displacements.cols(), nodes = displacements.rows() / 3;
  const auto corner_mass = [&](int tet) {
    return body.mesh.material_of(tet).density * gradient.volumes()[tet] / 4;
  };
  BaseLoad load;
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(nodes);
  for (int tet = 0; tet < gradient.tet_count(); ++tet)
    for (int corner = 0; corner < 4; ++corner)
      mass[gradient.tets()(corner, tet)] += corner_mass(tet);
  const Eigen::VectorXd of_axes = mass.replicate(1, 3).transpose().reshaped();
  load.masses = modes.cwiseAbs2().transpose() * of_axes;
  // R^T a by the tets around each node, in shares of its mass.
  Eigen::MatrixXd turned = Eigen::MatrixXd::Zero(displacements.rows(), frames);
  parallel_for(frames, 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t frame = begin; frame < end; ++frame) {
      const Eigen::VectorXd acceleration = displacements.col((frame + 1) % frames) -
                                           2 * displacements.col(frame) +
                                           displacements.col((frame + frames - 1) % frames);
      const Eigen::VectorXd here = displacements.col(frame);
      for (int tet = 0; tet < gradient.tet_count(); ++tet) {
        const Eigen::Matrix3d back =
            rotation_of(Eigen::Matrix3d::Identity() + gradient.apply(here, tet)).transpose();
        for (int corner = 0; corner < 4; ++corner) {
          const Eigen::Index node = gradient.tets()(corner, tet);
          turned.col(frame).segment<3>(3 * node) +=
              corner_mass(tet) * (back * acceleration.segment<3>(3 * node));
        }
      }
    }
  });
  load.forces = -(modes.transpose() * turned);
  load.forces.topRows(free_modes).setZero();
  return load;
}

}  // namespace limber::reduced
