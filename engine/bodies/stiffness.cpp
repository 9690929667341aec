#include "engine/bodies/stiffness.h"

#include "engine/bodies/node_graph.h"

namespace limber::bodies {

Eigen::Matrix<double, 12, 12> tet_stiffness(
    const Eigen::Ref<const Eigen::Matrix<double, 3, 4>>& shape_gradients, double volume,
    const Material& material) {
  const double lambda = volume * material.lame_lambda();
  const double mu = volume * material.lame_mu();
  Eigen::Matrix<double, 12, 12> result;
  for (int b = 0; b < 4; ++b) {
    for (int a = 0; a < 4; ++a) {
      const Eigen::Vector3d ga = shape_gradients.col(a);
      const Eigen::Vector3d gb = shape_gradients.col(b);
      result.block<3, 3>(3 * a, 3 * b) = lambda * ga * gb.transpose() + mu * gb * ga.transpose();
      result.block<3, 3>(3 * a, 3 * b).diagonal().array() += mu * ga.dot(gb);
    }
  }
  return result;
}

Eigen::SparseMatrix<double> stiffness_matrix(const TetMesh& mesh,
                                             const GradientOperator& gradient) {
  return NodeGraph(mesh.tets, mesh.node_count()).assemble_vector([&](int e) {
    return tet_stiffness(gradient.shape_gradients(e), gradient.volumes()[e], mesh.material_of(e));
  });
}

Eigen::SparseMatrix<double> stiffness_matrix(const TetMesh& mesh) {
  return stiffness_matrix(mesh, GradientOperator(mesh));
}

double strain_energy(const TetMesh& mesh, const GradientOperator& gradient,
                     const Eigen::Ref<const Eigen::VectorXd>& u) {
  double energy = 0;
  for (int e = 0; e < mesh.tet_count(); ++e) {
    const Eigen::Matrix3d h = gradient.apply(u, e);
    const Eigen::Matrix3d strain = (h + h.transpose()) / 2;
    const Material& material = mesh.material_of(e);
    const double trace = strain.trace();
    energy += gradient.volumes()[e] * (material.lame_lambda() / 2 * trace * trace +
                                       material.lame_mu() * strain.squaredNorm());
  }
  return energy;
}

Eigen::VectorXd elastic_forces(const TetMesh& mesh, const GradientOperator& gradient,
                               const Eigen::Ref<const Eigen::VectorXd>& u) {
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(u.size());
  for (int e = 0; e < mesh.tet_count(); ++e) {
    const Eigen::Matrix3d h = gradient.apply(u, e);
    const Material& material = mesh.material_of(e);
    Eigen::Matrix3d stress = material.lame_mu() * (h + h.transpose());
    stress.diagonal().array() += material.lame_lambda() * h.trace();
    const Eigen::Matrix<double, 3, 4> of_corners =
        gradient.volumes()[e] * stress * gradient.shape_gradients(e);
    for (int a = 0; a < 4; ++a) forces.segment<3>(3 * mesh.tets(a, e)) += of_corners.col(a);
  }
  return forces;
}

}  // namespace limber::bodies
