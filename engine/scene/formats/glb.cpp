// Triangle surfaces in binary glTF 2.0 (Khronos, "glTF 2.0 Specification").
#include <Eigen/Geometry>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/base/checked_number.h"
#include "engine/scene/formats/glb_file.h"
#include "engine/scene/formats/surface_readers.h"

namespace limber::scene::formats {
namespace {

// Nodes may repeat a mesh: this many triangles at least, and as many as the file has bytes.
constexpr std::int64_t kMinTriangleLimit = 1'000'000;
constexpr std::int64_t kTriangles = 4, kStrip = 5, kFan = 6;  // primitive.mode

class GlbReader {
 public:
  GlbReader(const TextCursor& file, std::string_view content)
      : file_(file), glb_(file, content), merger_(builder_) {}

  TriangleSurface read() {
    const Json& document = glb_.document();
    add_nodes(
        glb_.entry(glb_.list(document, "scenes"), glb_.member(document, "scene", 0), "scene"));
    TriangleSurface surface = builder_.finish(file_);
    const auto warn = [&](std::int64_t count, const char* what) {
      if (count > 0) surface.warnings.push_back(std::to_string(count) + what);
    };
    warn(points_and_lines_, " primitives of points or lines are left out");
    warn(collapsed_, " triangles with coinciding corners are left out");
    warn(skinned_, " nodes have a skin, which is left out: vertices are where the mesh has them");
    warn(morphed_, " primitives have morph targets, which are left out");
    return surface;
  }

 private:
  /// Numbers of a node, which keep their values if it has none.
  template <int Count>
  bool read_numbers(const Json& node, const char* name,
                    Eigen::Matrix<double, Count, 1>& values) const {
    if (!node.contains(name)) return false;
    const Json& given = glb_.list(node, name);
    if (given.size() != Count)
      file_.fail(std::string(name) + " is no list of " + std::to_string(Count) + " numbers");
    for (int i = 0; i < Count; ++i) {
      const Json& value = given[static_cast<std::size_t>(i)];
      if (!value.is_number()) file_.fail(std::string(name) + " has an entry that is no number");
      values[i] = value.get<double>();
    }
    return true;
  }

  [[nodiscard]] Eigen::Affine3d placement(const Json& node) const {
    Eigen::Affine3d result;
    Eigen::Matrix<double, 16, 1> columns;
    if (read_numbers<16>(node, "matrix", columns)) {
      result.matrix() = columns.reshaped(4, 4);
      return result;
    }
    Eigen::Vector3d translation(0, 0, 0), scale(1, 1, 1);
    Eigen::Vector4d rotation(0, 0, 0, 1);  // x, y, z, w, as Eigen keeps them
    read_numbers<3>(node, "translation", translation);
    read_numbers<3>(node, "scale", scale);
    read_numbers<4>(node, "rotation", rotation);
    if (!(rotation.norm() > 0)) file_.fail("a rotation has the length 0");
    result = Eigen::Translation3d(translation) * Eigen::Quaterniond(rotation.normalized()) *
             Eigen::Scaling(scale);
    return result;
  }

  /// Meshes of a scene's nodes, in the order of the file. Nodes are trees: each is met once.
  void add_nodes(const Json& scene) {
    const Json& nodes = glb_.list(glb_.document(), "nodes");
    std::vector<char> is_met(nodes.size(), 0);
    std::vector<std::pair<std::size_t, Eigen::Affine3d>> open;
    const auto open_all = [&](const Json& children, const Eigen::Affine3d& parent) {
      for (auto child = children.rbegin(); child != children.rend(); ++child) {
        const std::int64_t number = glb_.whole(*child, "node");
        static_cast<void>(glb_.entry(nodes, number, "node"));
        const auto at = static_cast<std::size_t>(number);
        if (std::exchange(is_met[at], 1) != 0)
          file_.fail("node " + std::to_string(number) + " has two parents");
        open.emplace_back(at, parent);
      }
    };
    open_all(glb_.list(scene, "nodes"), Eigen::Affine3d::Identity());
    while (!open.empty()) {
      const auto [number, parent] = open.back();
      open.pop_back();
      const Json& node = nodes[number];
      const Eigen::Affine3d at = parent * placement(node);
      if (node.contains("mesh")) {
        if (node.contains("skin")) ++skinned_;
        for (const Json& primitive : glb_.list(glb_.entry_of("meshes", node, "mesh"), "primitives"))
          add_primitive(primitive, at);
      }
      open_all(glb_.list(node, "children"), at);
    }
  }

  void add_primitive(const Json& primitive, const Eigen::Affine3d& at) {
    const std::int64_t mode = glb_.member(primitive, "mode", kTriangles);
    if (mode < kTriangles || mode > kFan) {
      ++points_and_lines_;
      return;
    }
    if (primitive.contains("targets")) ++morphed_;
    const auto attributes = primitive.find("attributes");
    if (attributes == primitive.end() || !attributes->contains("POSITION"))
      file_.fail("a primitive has no positions");
    const GlbAccessor points = glb_.accessor(*attributes, "POSITION", "VEC3", 3);
    GlbAccessor indices;
    const bool is_indexed = primitive.contains("indices");
    if (is_indexed) indices = glb_.accessor(primitive, "indices", "SCALAR", 1);
    const auto vertex = [&](std::int64_t corner) {
      if (!is_indexed) return corner;
      const auto index = to_whole<std::int64_t>(indices.value(corner));
      if (!index || *index < 0 || *index >= points.count()) {
        file_.fail("a triangle uses a vertex that is none of " + std::to_string(points.count()));
      }
      return *index;
    };
    const std::int64_t corners = is_indexed ? indices.count() : points.count();
    const std::int64_t triangles = mode == kTriangles ? corners / 3 : corners - 2;
    // The standard winds triangles the other way below a node that mirrors them.
    const bool is_mirrored = at.linear().determinant() < 0;
    for (std::int64_t t = 0; t < triangles; ++t) {
      std::array<std::int64_t, 3> of = {3 * t, 3 * t + 1, 3 * t + 2};
      if (mode == kStrip) of = {t, t + 1 + t % 2, t + 2 - t % 2};
      if (mode == kFan) of = {t + 1, t + 2, 0};
      if (is_mirrored) std::swap(of[1], of[2]);
      for (std::int64_t& corner : of) corner = merged(points, vertex(corner), at);
      add_triangle(of);
    }
  }

  std::int64_t merged(const GlbAccessor& points, std::int64_t vertex, const Eigen::Affine3d& at) {
    const Eigen::Vector3d point =
        at *
        Eigen::Vector3d(points.value(vertex, 0), points.value(vertex, 1), points.value(vertex, 2));
    if (!point.allFinite())
      file_.fail("a coordinate of vertex " + std::to_string(vertex) + " is not finite");
    return merger_.index(point.x(), point.y(), point.z());
  }

  void add_triangle(const std::array<std::int64_t, 3>& corners) {
    const std::int64_t limit = std::max(kMinTriangleLimit, glb_.size());
    if (++triangles_ > limit) {
      file_.fail_at(1,
                    "nodes repeat meshes to more than " + std::to_string(limit) +
                        " triangles, the limit for a file of this size",
                    ErrorCode::kLimitExceeded);
    }
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0])
      ++collapsed_;
    else
      builder_.add_polygon({corners.begin(), corners.end()}, 1);
  }

  const TextCursor& file_;
  GlbFile glb_;
  SurfaceBuilder builder_;
  CornerMerger merger_;
  std::int64_t triangles_ = 0, collapsed_ = 0, points_and_lines_ = 0, skinned_ = 0, morphed_ = 0;
};

}  // namespace

TriangleSurface read_glb(const TextCursor& file, std::string_view content) {
  return GlbReader(file, content).read();
}

}  // namespace limber::scene::formats
