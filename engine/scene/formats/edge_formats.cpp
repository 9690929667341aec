#include "engine/scene/formats/edge_formats.h"

#include <cmath>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/line_formats.h"
#include "engine/scene/formats/mesh_formats.h"
#include "engine/scene/formats/ply_file.h"

namespace limber::scene {
namespace {

using formats::PlyElement;
using formats::PlyFile;
using formats::PlyProperty;
using formats::TextCursor;

/// Values of the named scalar properties of one row; the others are passed over.
template <std::size_t N>
std::array<double, N> read_row(PlyFile& ply, const PlyElement& element,
                               const std::array<const char*, N>& names,
                               std::array<bool, N>& found) {
  std::array<double, N> row{};
  for (const PlyProperty& property : element.properties) {
    const std::vector<double>& values = ply.read(property);
    for (std::size_t i = 0; i < N; ++i) {
      if (property.list || property.name != names[i]) continue;
      row[i] = values[0];
      found[i] = true;
    }
  }
  return row;
}

class PlyEdges {
 public:
  explicit PlyEdges(TextCursor& file) : file_(file), ply_(file) {}

  EdgeMesh read() {
    for (const PlyElement& element : ply_.elements()) {
      ply_.check_count(element);
      for (std::int64_t i = 0; i < element.count; ++i) {
        if (element.name == "vertex") {
          read_vertex(element);
        } else if (element.name == "edge") {
          read_edge(element);
        } else {
          for (const PlyProperty& property : element.properties) ply_.read(property);
        }
      }
    }
    return finish();
  }

 private:
  void read_vertex(const PlyElement& element) {
    std::array<bool, 6> found{};
    const auto row = read_row<6>(ply_, element, {"x", "y", "z", "nx", "ny", "nz"}, found);
    if (!found[0] || !found[1] || !found[2]) file_.fail("vertices need the properties x, y and z");
    for (const double value : row) {
      if (!std::isfinite(value))
        file_.fail("a number of vertex " + std::to_string(vertices_.size()) + " is not finite");
    }
    vertices_.emplace_back(row[0], row[1], row[2]);
    const bool normal = found[3] && found[4] && found[5];
    normals_.emplace_back(normal ? Eigen::Vector3d(row[3], row[4], row[5])
                                 : Eigen::Vector3d(0, 0, 1));
  }

  void read_edge(const PlyElement& element) {
    std::array<bool, 2> found{};
    const auto row = read_row<2>(ply_, element, {"vertex1", "vertex2"}, found);
    if (!found[0] || !found[1]) file_.fail("edges need the properties vertex1 and vertex2");
    Edge edge{{}, file_.line()};
    for (std::size_t end = 0; end < 2; ++end) {
      const auto vertex = to_whole<int>(row[end]);
      if (!vertex) file_.fail("a vertex index that is no whole number");
      edge.vertices[end] = *vertex;
    }
    edges_.push_back(edge);
  }

  EdgeMesh finish() const {
    if (edges_.empty()) file_.fail("the file has no edges");
    const auto count = static_cast<std::int64_t>(vertices_.size());
    EdgeMesh mesh;
    for (const Edge& edge : edges_) {
      for (const int index : edge.vertices) {
        if (index < 0 || index >= count)
          file_.fail_at(edge.line, "an edge uses vertex " + std::to_string(index) +
                                       " (from 0) of " + std::to_string(count));
      }
      mesh.edges.emplace_back(edge.vertices[0], edge.vertices[1]);
    }
    mesh.vertices.resize(3, static_cast<Eigen::Index>(count));
    mesh.normals.resize(3, static_cast<Eigen::Index>(count));
    for (Eigen::Index i = 0; i < mesh.vertices.cols(); ++i) {
      mesh.vertices.col(i) = vertices_[static_cast<std::size_t>(i)];
      mesh.normals.col(i) = normals_[static_cast<std::size_t>(i)];
    }
    return mesh;
  }

  struct Edge {
    std::array<int, 2> vertices;
    std::int64_t line;
  };
  TextCursor& file_;
  PlyFile ply_;
  std::vector<Eigen::Vector3d> vertices_, normals_;
  std::vector<Edge> edges_;
};

}  // namespace

EdgeMesh read_edge_mesh(const std::string& name, std::string_view content) {
  const std::string ending = formats::to_lower(std::filesystem::path(name).extension().string());
  if (ending == ".ply") {
    TextCursor file(name, content);
    return PlyEdges(file).read();
  }
  if (ending != ".obj")
    throw Error(ErrorCode::kUnsupported, name, name + ": edges are read from .ply and .obj");
  const rods::LineMesh lines = read_line_mesh(name, content);
  EdgeMesh mesh;
  mesh.vertices = lines.vertices;
  mesh.normals = Eigen::Vector3d(0, 0, 1).replicate(1, lines.vertices.cols());
  for (Eigen::Index e = 0; e < lines.edges.cols(); ++e)
    mesh.edges.emplace_back(lines.edges(0, e), lines.edges(1, e));
  return mesh;
}

EdgeMesh read_edge_mesh_file(const std::filesystem::path& path) {
  return read_edge_mesh(path.filename().string(), read_bytes(path));
}

}  // namespace limber::scene
