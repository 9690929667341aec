#include "engine/scene/triangle_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "engine/base/error.h"

namespace limber::scene {
namespace {

struct HalfEdge {
  int low, high;
  bool forward;  // walked from low to high by its triangle
  bool operator<(const HalfEdge& o) const {
    return std::array{low, high, static_cast<int>(forward)} <
           std::array{o.low, o.high, static_cast<int>(o.forward)};
  }
};

void remember(int (&first)[2], const HalfEdge& edge) {
  if (first[0] >= 0) return;
  first[0] = edge.low;
  first[1] = edge.high;
}

std::string edge_text(const int (&edge)[2]) {
  return "between vertices " + std::to_string(edge[0]) + " and " + std::to_string(edge[1]);
}

[[noreturn]] void refuse(const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, "surface",
              "the surface does not enclose a body: " + message);
}

}  // namespace

SurfaceCheck check_surface(const TriangleSurface& surface) {
  SurfaceCheck result;
  std::vector<HalfEdge> edges;
  edges.reserve(3 * static_cast<std::size_t>(surface.triangle_count()));
  const Eigen::Vector3d origin = surface.vertex_count() > 0
                                     ? Eigen::Vector3d(surface.vertices.rowwise().mean())
                                     : Eigen::Vector3d::Zero();
  for (int t = 0; t < surface.triangle_count(); ++t) {
    const Eigen::Vector3i tri = surface.triangles.col(t);
    for (int e = 0; e < 3; ++e) {
      const int a = tri[e], b = tri[(e + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b});
    }
    const Eigen::Vector3d a = surface.vertices.col(tri[0]) - origin,
                          b = surface.vertices.col(tri[1]) - origin,
                          c = surface.vertices.col(tri[2]) - origin;
    result.volume += a.dot(b.cross(c)) / 6;
    if ((b - a).cross(c - a).squaredNorm() == 0) ++result.degenerate_triangles;
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t begin = 0; begin < edges.size();) {
    std::size_t end = begin;
    int forward = 0;
    while (end < edges.size() && edges[end].low == edges[begin].low &&
           edges[end].high == edges[begin].high) {
      forward += edges[end++].forward ? 1 : 0;
    }
    const std::size_t count = end - begin;
    if (count == 1) {
      ++result.open_edges;
      remember(result.first_open_edge, edges[begin]);
    } else if (count > 2) {
      ++result.crowded_edges;
      remember(result.first_crowded_edge, edges[begin]);
    } else if (forward != 1) {
      ++result.flipped_edges;
      remember(result.first_flipped_edge, edges[begin]);
    }
    begin = end;
  }
  return result;
}

TriangleSurface closed_outward(const TriangleSurface& surface) {
  if (surface.triangle_count() == 0) refuse("it has no triangles");
  if (surface.triangles.minCoeff() < 0 || surface.triangles.maxCoeff() >= surface.vertex_count()) {
    refuse("a triangle uses a vertex that does not exist");
  }
  if (!surface.vertices.allFinite()) refuse("a vertex has a coordinate that is not finite");
  const SurfaceCheck check = check_surface(surface);
  if (check.open_edges > 0) {
    refuse(std::to_string(check.open_edges) +
           " edges belong to one triangle only (holes), the first " +
           edge_text(check.first_open_edge));
  }
  if (check.crowded_edges > 0) {
    refuse(std::to_string(check.crowded_edges) +
           " edges belong to three or more triangles, the first " +
           edge_text(check.first_crowded_edge));
  }
  if (check.flipped_edges > 0) {
    refuse("triangles are oriented against each other at " + std::to_string(check.flipped_edges) +
           " edges, the first " + edge_text(check.first_flipped_edge));
  }
  if (check.volume == 0) refuse("its volume is zero");
  TriangleSurface result = surface;
  if (check.volume < 0) {
    result.triangles.row(1).swap(result.triangles.row(2));
    result.warnings.push_back("the surface was oriented inward and is turned over");
  }
  return result;
}

}  // namespace limber::scene
