#include "engine/reduced/base_load.h"

#include "engine/base/rotations/exponential_map.h"
#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/mass.h"
#include "engine/reduced/rs_coordinates.h"
#include "engine/reduced/rs_inverse.h"

namespace limber::reduced {

Eigen::MatrixXd BaseLoad::of_modes(const Eigen::MatrixXd& mixing) const {
  const Eigen::VectorXd mixed = mixing.cwiseAbs2().transpose() * masses;
  return mixed.cwiseInverse().asDiagonal() * (mixing.transpose() * forces);
}

BaseLoadSum::BaseLoadSum(const bodies::ElasticBody& body, const Eigen::MatrixXd& modes,
                         int free_modes, const Eigen::Ref<const Eigen::MatrixXd>& displacements)
    : mesh_(body.mesh),
      modes_(modes),
      free_modes_(free_modes),
      displacements_(displacements),
      corner_mass_(bodies::GradientOperator(body.mesh).volumes() / 4) {
  for (int tet = 0; tet < mesh_.tet_count(); ++tet)
    corner_mass_[tet] *= mesh_.material_of(tet).density;
  const Eigen::VectorXd mass = bodies::lumped_node_mass(mesh_);
  load_.masses = modes.cwiseAbs2().transpose() * mass.replicate(1, 3).transpose().reshaped();
  load_.forces = Eigen::MatrixXd::Zero(modes.cols(), displacements.cols());
}

void BaseLoadSum::add(Eigen::Index frame, const Eigen::VectorXd& y) {
  const Eigen::Index frames = displacements_.cols();
  const Eigen::VectorXd acceleration = displacements_.col((frame + 1) % frames) -
                                       2 * displacements_.col(frame) +
                                       displacements_.col((frame + frames - 1) % frames);
  // R^T a by the tets around each node, in shares of its mass.
  Eigen::VectorXd turned = Eigen::VectorXd::Zero(acceleration.size());
  for (int tet = 0; tet < mesh_.tet_count(); ++tet) {
    const Eigen::Vector3d theta = y.segment<3>(kRsSize * Eigen::Index{tet});
    const Eigen::Matrix3d back = corner_mass_[tet] * rotations::exponential(-theta);
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Index first = 3 * Eigen::Index{mesh_.tets(corner, tet)};
      turned.segment<3>(first) += back * acceleration.segment<3>(first);
    }
  }
  load_.forces.col(frame).noalias() = -modes_.transpose() * turned;
  load_.forces.col(frame).head(free_modes_).setZero();
}

BaseLoad base_load(const bodies::ElasticBody& body, const Eigen::MatrixXd& modes, int free_modes,
                   const Eigen::Ref<const Eigen::MatrixXd>& displacements, const JobContext& job) {
  const bodies::GradientOperator gradient(body.mesh);
  const RsInverse inverse(body, gradient);
  RsTrack track;
  BaseLoadSum sum(body, modes, free_modes, displacements);
  for (Eigen::Index frame = 0; frame < displacements.cols(); ++frame) {
    job.throw_if_cancelled();
    sum.add(frame, inverse.coordinates(displacements.col(frame), track));
  }
  return sum.load();
}

}  // namespace limber::reduced
