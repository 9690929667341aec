#include "engine/session/bodies/geometry.h"

#include "engine/base/hash.h"
#include "engine/scene/embedding/surface_points.h"

namespace limber::session {

Geometry rest_geometry(const scene::Scene& scene, const MappedBody& mapped) {
  Geometry geometry;
  geometry.rest = scene.mesh.nodes;
  geometry.tets = scene.mesh.tets;
  // From the prepared tets: they are oriented, and a face between merged duplicates is no boundary.
  geometry.surface = scene::mesh_surface(mapped.body.mesh.tets, mapped.source_of_compact);
  geometry.repairs = mapped.repairs;
  geometry.warnings = mapped.warnings;
  return geometry;
}

Eigen::MatrixXd source_displacements(const scene::Scene& scene,
                                     const std::vector<int>& compact_of_source,
                                     const Eigen::Ref<const Eigen::MatrixXd>& displacements) {
  const LengthUnit unit(scene.length_unit_in_metres);
  const Eigen::Index sources = scene.mesh.node_count();
  Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(3 * sources, displacements.cols());
  for (Eigen::Index node = 0; node < sources; ++node) {
    const int compact = compact_of_source[static_cast<std::size_t>(node)];
    if (compact < 0) continue;
    moved.middleRows(3 * node, 3) =
        unit.to_scene(displacements.middleRows(3 * compact, 3).array()).matrix();
  }
  return moved;
}

Geometry with_basis(Geometry geometry, const scene::Scene& scene,
                    const std::vector<int>& compact_of_source, const Eigen::MatrixXd& basis) {
  geometry.basis = source_displacements(scene, compact_of_source, basis).cast<float>();
  geometry.basis_hash = ContentHash().add("limber basis 1").add(geometry.basis).hex();
  return geometry;
}

Geometry make_geometry(const scene::Scene& scene, const MappedBody& mapped,
                       const reduced::ReducedModel& model) {
  return with_basis(rest_geometry(scene, mapped), scene, mapped.compact_of_source, model.basis);
}

Eigen::MatrixXd positions_of(const Geometry& geometry, const LengthUnit& unit,
                             const std::vector<int>& compact_of_source,
                             const Eigen::MatrixXd& basis,
                             const Eigen::Ref<const Eigen::MatrixXf>& coordinates) {
  const Eigen::MatrixXd displacement = basis * coordinates.cast<double>();
  Eigen::MatrixXd positions(geometry.rest.size(), coordinates.cols());
  for (Eigen::Index node = 0; node < geometry.rest.cols(); ++node) {
    const int compact = compact_of_source[static_cast<std::size_t>(node)];
    auto rows = positions.middleRows(3 * node, 3);
    rows.colwise() = geometry.rest.col(node);
    if (compact >= 0)
      rows += unit.to_scene(displacement.middleRows(3 * compact, 3).array()).matrix();
  }
  return positions;
}

Eigen::MatrixXd source_positions(const scene::Scene& scene, const MappedBody& mapped,
                                 const Eigen::Ref<const Eigen::MatrixXd>& displacements) {
  const LengthUnit unit(scene.length_unit_in_metres);
  const auto& rest = scene.mesh.nodes;
  Eigen::MatrixXd positions(rest.size(), displacements.cols());
  for (Eigen::Index frame = 0; frame < displacements.cols(); ++frame) {
    for (Eigen::Index node = 0; node < rest.cols(); ++node) {
      const int compact = mapped.compact_of_source[static_cast<std::size_t>(node)];
      Eigen::Vector3d at = rest.col(node);
      if (compact >= 0) {
        at += unit.to_scene(displacements.col(frame).segment<3>(3 * compact).array()).matrix();
      }
      positions.col(frame).segment<3>(3 * node) = at;
    }
  }
  return positions;
}

scene::Scene with_base_motion(scene::Scene scene, const Eigen::MatrixXd& positions) {
  const Eigen::Map<const Eigen::VectorXd> rest(scene.mesh.nodes.data(), scene.mesh.nodes.size());
  scene.base_motion = positions.colwise() - rest;
  scene.frame_count = static_cast<int>(positions.cols());
  const auto is_behind = [&](const auto& wish) { return wish.frame >= scene.frame_count; };
  std::erase_if(scene.constraints, is_behind);
  std::erase_if(scene.keyframes, is_behind);
  return scene;
}

}  // namespace limber::session
