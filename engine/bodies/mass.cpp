#include "engine/bodies/mass.h"

#include "engine/bodies/gradient_operator.h"
#include "engine/bodies/node_graph.h"

namespace limber::bodies {

Eigen::VectorXd lumped_node_mass(const TetMesh& mesh) {
  const GradientOperator gradient(mesh);
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(mesh.node_count());
  for (int e = 0; e < mesh.tet_count(); ++e) {
    const double quarter = mesh.material_of(e).density * gradient.volumes()[e] / 4;
    for (int a = 0; a < 4; ++a) mass[mesh.tets(a, e)] += quarter;
  }
  return mass;
}

Eigen::SparseMatrix<double> consistent_node_mass(const TetMesh& mesh) {
  const GradientOperator gradient(mesh);
  const Eigen::Matrix4d pattern = Eigen::Matrix4d::Ones() + Eigen::Matrix4d::Identity();
  return NodeGraph(mesh.tets, mesh.node_count()).assemble_scalar([&](int e) -> Eigen::Matrix4d {
    return mesh.material_of(e).density * gradient.volumes()[e] / 20 * pattern;
  });
}

Eigen::SparseMatrix<double> mass_matrix(const TetMesh& mesh) {
  return NodeGraph::expand_to_axes(consistent_node_mass(mesh));
}

}  // namespace limber::bodies
