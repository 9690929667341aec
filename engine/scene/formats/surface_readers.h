#pragma once

#include <array>
#include <map>

#include "engine/scene/formats/text_cursor.h"
#include "engine/scene/triangle_surface.h"

namespace limber::scene::formats {

[[nodiscard]] TriangleSurface read_obj(TextCursor& file);
[[nodiscard]] TriangleSurface read_ply(TextCursor& file);
[[nodiscard]] TriangleSurface read_stl(TextCursor& file, std::string_view content);
/// Geomview's OFF as text: OFF, COFF, NOFF, STOFF and their mixtures, or counts without a keyword.
[[nodiscard]] TriangleSurface read_off(TextCursor& file);
/// Binary glTF 2.0: triangles, strips and fans of the default scene, moved by their nodes.
[[nodiscard]] TriangleSurface read_glb(const TextCursor& file, std::string_view content);

/// Collects vertices and polygons and checks indices at the end.
class SurfaceBuilder {
 public:
  void add_vertex(double x, double y, double z) { vertices_.emplace_back(x, y, z); }
  /// Fans a polygon; indices from 0, not yet checked. @returns false for fewer than three corners.
  bool add_polygon(const std::vector<std::int64_t>& corners, std::int64_t line);
  [[nodiscard]] std::int64_t vertex_count() const {
    return static_cast<std::int64_t>(vertices_.size());
  }
  /// @throws Error through `file` for an index that no vertex has or a surface without triangles.
  [[nodiscard]] TriangleSurface finish(const TextCursor& file);

 private:
  struct Triangle {
    std::int64_t corners[3];
    std::int64_t line;
  };
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Triangle> triangles_;
  std::int64_t polygons_ = 0;
};

/// Gives equal corners one vertex; -0 and 0 are equal.
class CornerMerger {
 public:
  explicit CornerMerger(SurfaceBuilder& builder) : builder_(builder) {}
  std::int64_t index(double x, double y, double z) {
    const auto [entry, is_new] =
        known_.try_emplace({x + 0.0, y + 0.0, z + 0.0}, builder_.vertex_count());
    if (is_new) builder_.add_vertex(x, y, z);
    return entry->second;
  }

 private:
  SurfaceBuilder& builder_;
  std::map<std::array<double, 3>, std::int64_t> known_;
};

}  // namespace limber::scene::formats
