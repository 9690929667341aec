#include "engine/session/geometry.h"

#include "engine/base/hash.h"
#include "engine/bodies/boundary_surface.h"

namespace limber::session {

Geometry rest_geometry(const scene::Scene& scene, const MappedBody& mapped) {
  Geometry geometry;
  geometry.rest = scene.mesh.nodes;
  geometry.tets = scene.mesh.tets;
  // From the prepared tets: they are oriented, and a face between merged duplicates is no boundary.
  geometry.surface = bodies::boundary_surface(mapped.body.mesh.tets);
  for (Eigen::Index t = 0; t < geometry.surface.cols(); ++t) {
    for (int c = 0; c < 3; ++c) {
      int& node = geometry.surface(c, t);
      node = mapped.source_of_compact[static_cast<std::size_t>(node)];
    }
  }
  geometry.repairs = mapped.repairs;
  geometry.warnings = mapped.warnings;
  return geometry;
}

Geometry make_geometry(const scene::Scene& scene, const MappedBody& mapped,
                       const reduced::ReducedModel& model) {
  const LengthUnit unit(scene.length_unit_in_metres);
  Geometry geometry = rest_geometry(scene, mapped);
  const Eigen::Index sources = scene.mesh.node_count();
  geometry.basis.setZero(3 * sources, model.basis_size());
  for (Eigen::Index node = 0; node < sources; ++node) {
    const int compact = mapped.compact_of_source[static_cast<std::size_t>(node)];
    if (compact < 0) continue;
    geometry.basis.middleRows(3 * node, 3) =
        unit.to_scene(model.basis.middleRows(3 * compact, 3).array()).matrix().cast<float>();
  }
  geometry.basis_hash = ContentHash().add("limber basis 1").add(geometry.basis).hex();
  return geometry;
}

Eigen::MatrixXd positions_of(const Geometry& geometry, const LengthUnit& unit,
                             const std::vector<int>& compact_of_source,
                             const reduced::ReducedModel& model,
                             const Eigen::Ref<const Eigen::MatrixXf>& coordinates) {
  const Eigen::MatrixXd displacement = model.basis * coordinates.cast<double>();
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

}  // namespace limber::session
