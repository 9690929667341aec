#include "server/cli/tetrahedralize.h"

#include <fmt/format.h>

#include "engine/scene/formats/mesh_writers.h"
#include "engine/scene/formats/surface_formats.h"
#include "server/cli/local_files.h"
#include "server/cli/print_json.h"
#include "server/cli/progress_bar.h"
#include "server/kinds/bodies/tetrahedralization.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

void check_mesh_name(const fs::path& path) {
  if (path.extension() != ".msh" && path.extension() != ".vtu") {
    throw invalid("output", "a file name ending in .msh or .vtu is expected");
  }
}

std::string mesh_bytes(const fs::path& path, const bodies::TetMesh& mesh) {
  return path.extension() == ".msh" ? scene::write_msh(mesh) : scene::write_vtu(mesh);
}

/// Beside the mesh, where opening the mesh finds it: STEM.surface.obj.
void keep_surface(const TetrahedralizeCommand& command) {
  const std::string ending = scene::surface_ending(command.surface.string());
  const fs::path kept = fs::path(command.output).replace_extension(".surface" + ending);
  std::error_code ignored;
  if (fs::equivalent(kept, command.surface, ignored)) return;
  write_file(kept, scene::read_bytes(command.surface));
}

void print_text(const TetrahedralizeCommand& command, const scene::Tetrahedralization& result) {
  fmt::print("{}: {} nodes, {} tets\n", command.output.string(), result.mesh.node_count(),
             result.mesh.tet_count());
  const scene::SurfaceFit& fit = result.fit.value();
  fmt::print(
      "distance: surface to mesh {:.3g}, mesh to surface {:.3g}: {:.2g} % of the body's length "
      "(within {:.3g} %)\n",
      fit.surface_to_mesh, fit.mesh_to_surface, 100 * fit.distance_share, 100 * fit.within);
  if (fit.share_beyond > 0)
    fmt::print("{:.2g} % of the surface's vertices are farther away\n", 100 * fit.share_beyond);
  fmt::print("volume: surface {:.4g}, mesh {:.4g} ({:+.2g} %)\n", fit.surface_volume,
             fit.mesh_volume, 100 * (fit.mesh_volume / fit.surface_volume - 1));
}

}  // namespace

int tetrahedralize_file(const TetrahedralizeCommand& command) {
  check_mesh_name(command.output);
  command.options.validate();
  const scene::TriangleSurface surface = scene::read_surface_file(command.surface);
  scene::Tetrahedralization result;
  {
    ProgressBar bar;
    JobContext job;
    job.progress = [&](const std::string& stage, double fraction) { bar.show(stage, fraction); };
    result = scene::tetrahedralize(surface, command.options, job);
    bar.show("done", 1);
  }
  for (const auto& text : result.notes) fmt::print(stderr, "warning: {}\n", text);
  write_file(command.output, mesh_bytes(command.output, result.mesh));
  keep_surface(command);
  if (command.json) {
    print_json(encode_report(result));
  } else {
    print_text(command, result);
  }
  return 0;
}

}  // namespace limber::server
