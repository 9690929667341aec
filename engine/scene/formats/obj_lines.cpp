// Wavefront .obj as a line mesh: "v x y z" and "l i j k ...".
#include <vector>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/line_formats.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/obj_elements.h"

namespace limber::scene {
namespace {

using formats::TextCursor;

struct Edge {
  std::int64_t vertices[2];
  std::int64_t line;
};

rods::LineMesh to_mesh(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Edge>& edges,
                       const TextCursor& file) {
  if (edges.empty()) file.fail("the file has no lines");
  rods::LineMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    mesh.vertices.col(static_cast<Eigen::Index>(i)) = vertices[i];
  mesh.edges.resize(2, static_cast<Eigen::Index>(edges.size()));
  for (std::size_t e = 0; e < edges.size(); ++e) {
    for (int end = 0; end < 2; ++end) {
      const std::int64_t given = edges[e].vertices[end];
      const auto index = to_whole<int>(given);
      if (!index || *index < 0 || *index >= mesh.vertices.cols()) {
        file.fail_at(edges[e].line, "a line uses vertex " + std::to_string(given) +
                                        " (from 0) of " + std::to_string(vertices.size()));
      }
      mesh.edges(end, static_cast<Eigen::Index>(e)) = *index;
    }
  }
  if (const auto fault = rods::fault_of(mesh); fault && fault->edge >= 0)
    file.fail_at(edges[static_cast<std::size_t>(fault->edge)].line, fault->message, fault->code);
  return mesh;
}

void read_line(TextCursor& file, std::int64_t line, std::int64_t vertex_count,
               std::vector<Edge>& edges) {
  std::int64_t previous = 0;
  int corners = 0;
  while (file.skip_blanks_in_line()) {
    const std::int64_t index = formats::obj_vertex_index(file.word(), vertex_count, file, line);
    if (corners++ > 0) edges.push_back({{previous, index}, line});
    previous = index;
  }
  if (corners < 2) file.fail_at(line, "a line of fewer than two vertices");
}

}  // namespace

rods::LineMesh read_line_mesh(const std::string& name, std::string_view content) {
  const std::string ending = formats::to_lower(std::filesystem::path(name).extension().string());
  if (ending != ".obj") {
    throw Error(ErrorCode::kUnsupported, name, name + ": line meshes are read from .obj");
  }
  TextCursor file(name, content);
  file.set_comment('#');
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Edge> edges;
  while (file.skip_blanks()) {
    const std::int64_t line = file.line();
    const std::string_view keyword = file.word();
    if (keyword == "v") {
      vertices.push_back(formats::obj_vertex(file));
    } else if (keyword == "l") {
      read_line(file, line, static_cast<std::int64_t>(vertices.size()), edges);
    } else {
      file.skip_line();
    }
  }
  return to_mesh(vertices, edges, file);
}

rods::LineMesh read_line_mesh_file(const std::filesystem::path& path) {
  return read_line_mesh(path.filename().string(), read_bytes(path));
}

}  // namespace limber::scene
