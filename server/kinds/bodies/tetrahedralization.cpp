#include "server/kinds/bodies/tetrahedralization.h"

namespace limber::server {

proto::TetrahedralizationReport encode_report(const scene::Tetrahedralization& result) {
  proto::TetrahedralizationReport report;
  report.set_tets(static_cast<std::uint32_t>(result.mesh.tet_count()));
  if (!result.fit) return report;
  report.set_surface_to_mesh(result.fit->surface_to_mesh);
  report.set_mesh_to_surface(result.fit->mesh_to_surface);
  report.set_distance_share(result.fit->distance_share);
  report.set_surface_volume(result.fit->surface_volume);
  report.set_mesh_volume(result.fit->mesh_volume);
  report.set_share_beyond(result.fit->share_beyond);
  report.set_within(result.fit->within);
  return report;
}

}  // namespace limber::server
