#include "engine/scene/samples/sample_parts.h"

#include "engine/base/error.h"

namespace limber::scene::samples {

bodies::TetMesh mesh_of(const ImplicitSolid& solid, const TetrahedralizeOptions& options) {
  Tetrahedralization result = tetrahedralize(solid, options);
  if (!result.notes.empty())
    throw Error(ErrorCode::kInternal, "sample", "a sample's mesh: " + result.notes[0]);
  return std::move(result.mesh);
}

void fix_where(Scene& scene, const std::function<bool(const Eigen::Vector3d&)>& inside) {
  for (int node = 0; node < scene.mesh.node_count(); ++node) {
    if (inside(scene.mesh.nodes.col(node))) scene.fixed_nodes.push_back(node);
  }
  LIMBER_DEMAND(!scene.fixed_nodes.empty());
}

int node_near(const bodies::TetMesh& mesh, const Eigen::Vector3d& point) {
  Eigen::Index nearest = 0;
  (mesh.nodes.colwise() - point).colwise().squaredNorm().minCoeff(&nearest);
  return static_cast<int>(nearest);
}

void add_target(Scene& scene, int frame, int node, const Eigen::Vector3d& displacement) {
  Constraint constraint;
  constraint.frame = frame;
  constraint.nodes = {node};
  constraint.target = displacement;
  scene.constraints.push_back(constraint);
}

}  // namespace limber::scene::samples
