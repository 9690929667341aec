#include "bench/stability/box_bodies.h"

#include "engine/bodies/mesh_validation.h"
#include "tests/engine/bodies/box_mesh.h"

namespace limber::bench::stability {

bodies::ElasticBody prepared(bodies::ElasticBody body) {
  bodies::PreparedMesh mesh = bodies::prepare_mesh(body.mesh, body.fixed_nodes);
  body.mesh = std::move(mesh.mesh);  // boxes use all their nodes: numbers stay
  return body;
}

bodies::ElasticBody box_body(std::array<int, 3> cells, const Eigen::Vector3d& size, Held held,
                             const bodies::Material& material) {
  using bodies::testing::Hold;
  return prepared(bodies::testing::box_body(
      cells, size, held == Held::kNothing ? Hold::kFree : Hold::kLeftFace, material));
}

void stiffen(bodies::ElasticBody& body, double contrast,
             const std::function<bool(const Eigen::Vector3d&)>& where) {
  bodies::Material stiff = body.mesh.materials[0];
  stiff.youngs_modulus *= contrast;
  body.mesh.materials.push_back(stiff);
  for (int e = 0; e < body.mesh.tet_count(); ++e) {
    const Eigen::Vector3d centre =
        body.mesh.nodes(Eigen::all, body.mesh.tets.col(e)).rowwise().mean();
    if (where(centre)) body.mesh.tet_material[static_cast<std::size_t>(e)] = 1;
  }
}

void make_sliver(bodies::ElasticBody& body, double share) {
  bodies::TetMesh& mesh = body.mesh;
  const Eigen::Vector4i tet = mesh.tets.col(mesh.tet_count() / 2 + 3);
  Eigen::Vector3d face = Eigen::Vector3d::Zero();
  for (int a = 1; a < 4; ++a) face += mesh.nodes.col(tet[a]) / 3;
  mesh.nodes.col(tet[0]) = face + share * (mesh.nodes.col(tet[0]) - face);
}

scene::Scene scene_of(const bodies::ElasticBody& body, double reach) {
  scene::Scene scene;
  scene.name = "box";
  scene.mesh = body.mesh;
  scene.fixed_nodes = body.fixed_nodes;
  scene.material = body.mesh.materials[0];
  scene.frame_count = 40;
  scene.dynamics.period_frames = 20;
  scene.model.mode_count = 10;
  int tip = 0;
  body.mesh.nodes.colwise().sum().maxCoeff(&tip);
  const double far = reach * body.length();
  for (const int frame : {13, 26}) {
    scene::Constraint constraint;
    constraint.frame = frame;
    constraint.nodes = {tip};
    constraint.target = far * Eigen::Vector3d(-0.1, frame == 13 ? 0.6 : -0.5, 0.4);
    scene.constraints.push_back(constraint);
  }
  return scene;
}

}  // namespace limber::bench::stability
