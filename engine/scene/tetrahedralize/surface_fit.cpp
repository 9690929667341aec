#include "engine/scene/tetrahedralize/surface_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "engine/base/disjoint_sets.h"
#include "engine/bodies/boundary_surface.h"

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;

/// Cuts triangles where the answer needs it, largest first where that matters.
class Search {
 public:
  Search(const TriangleTree* from_tree, const TriangleTree& to, const GapSearch& search)
      : from_tree_(from_tree), to_(to), search_(search) {}

  void add(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    set_outward(a, b, c);
    visit({a, b, c});
  }
  /// A first idea of the largest distance spares most of the cutting.
  void start_from(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const Vector3d middle = (a + b + c) / 3;
    const double distance = to_.distance(middle);
    if (distance <= result.largest) return;
    set_outward(a, b, c);
    if (is_outer(middle)) result.largest = distance;
  }
  OneSidedDistance result;

 private:
  void set_outward(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const Vector3d normal = (b - a).cross(c - a);
    outward_ = normal.norm() > 0 ? Vector3d(normal.normalized()) : Vector3d::Zero();
  }

  void visit(const std::array<Vector3d, 3>& first) {
    std::vector<std::array<Vector3d, 3>> stack = {first};
    while (!stack.empty()) {
      const auto [a, b, c] = stack.back();
      stack.pop_back();
      const Vector3d middle = (a + b + c) / 3;
      const double radius = std::sqrt(std::max(
          {(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()}));
      const auto [distance, triangle] = to_.nearest(middle);
      // The distance to one triangle is convex: largest in a corner. That of a point changes no
      // faster than the point.
      const double to_one = std::max(
          {to_.distance(a, triangle), to_.distance(b, triangle), to_.distance(c, triangle)});
      const double bound = std::min(distance + radius, to_one);
      const double bounded = std::max(result.largest, search_.ignored) + search_.resolution;
      if (bound <= search_.threshold && bound <= bounded) {
        result.bound = std::max(result.bound, bound);
        continue;
      }
      const bool counts =
          (distance <= result.largest && distance <= search_.threshold) || is_outer(middle);
      if (counts) result.largest = std::max(result.largest, distance);
      // Inside of overlapping parts, pieces need not be smaller than gaps are looked for.
      const bool is_fine = radius <= (counts ? search_.resolution : search_.spacing);
      if (is_fine || (radius <= search_.spacing && bound <= bounded)) {
        if (!counts) continue;
        if (distance > search_.threshold) result.gaps.push_back({middle, distance});
        result.bound = std::max(result.bound, bound);
        continue;
      }
      // At the longest edge: pieces stay round.
      std::array<Vector3d, 3> x = {a, b, c};
      std::size_t longest = 0;
      for (std::size_t e = 1; e < 3; ++e) {
        if ((x[(e + 1) % 3] - x[e]).squaredNorm() >
            (x[(longest + 1) % 3] - x[longest]).squaredNorm())
          longest = e;
      }
      const Vector3d p = x[longest], q = x[(longest + 1) % 3], r = x[(longest + 2) % 3];
      stack.push_back({p, (p + q) / 2, r});
      stack.push_back({(p + q) / 2, q, r});
    }
  }

  [[nodiscard]] bool is_outer(const Vector3d& x) const {
    if (from_tree_ == nullptr) return true;
    const double step = 1e-6 * from_tree_->bounds().diagonal().norm();
    return from_tree_->winding_number(x + step * outward_) < 0.5;
  }

  const TriangleTree* from_tree_;
  const TriangleTree& to_;
  const GapSearch& search_;
  Vector3d outward_ = {0, 0, 0};
};

}  // namespace

OneSidedDistance one_sided_distance(const TriangleSurface& from, const TriangleTree* from_tree,
                                    const TriangleTree& to, const GapSearch& search,
                                    const JobContext& job) {
  Search pending(from_tree, to, search);
  const auto at = [&](int t, int c) -> Vector3d { return from.vertices.col(from.triangles(c, t)); };
  for (int t = 0; t < from.triangle_count(); ++t) {
    if (t % 64 == 0) job.throw_if_cancelled();
    pending.start_from(at(t, 0), at(t, 1), at(t, 2));
  }
  for (int t = 0; t < from.triangle_count(); ++t) {
    if (t % 16 == 0) job.throw_if_cancelled();
    pending.add(at(t, 0), at(t, 1), at(t, 2));
  }
  pending.result.bound = std::max(pending.result.bound, pending.result.largest);
  return std::move(pending.result);
}

namespace {

/// Share of the vertices on the outside of the body that are farther than `limit` from `to`.
double vertices_beyond(const TriangleSurface& surface, const TriangleTree& tree,
                       const TriangleTree& to, double limit) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, surface.vertex_count());
  for (int t = 0; t < surface.triangle_count(); ++t) {
    const auto at = [&](int c) -> Vector3d {
      return surface.vertices.col(surface.triangles(c, t));
    };
    const Vector3d normal = (at(1) - at(0)).cross(at(2) - at(0));
    for (int c = 0; c < 3; ++c) normals.col(surface.triangles(c, t)) += normal;
  }
  const double step = 1e-6 * tree.bounds().diagonal().norm();
  int used = 0, beyond = 0;
  for (int v = 0; v < surface.vertex_count(); ++v) {
    if (!(normals.col(v).squaredNorm() > 0)) continue;
    ++used;
    const Vector3d x = surface.vertices.col(v);
    if (to.distance(x) <= limit) continue;
    if (tree.winding_number(x + step * normals.col(v).normalized()) < 0.5) ++beyond;
  }
  return used > 0 ? static_cast<double>(beyond) / used : 0;
}

}  // namespace

FitMeasurement measure_fit(const TriangleSurface& surface, const TriangleTree& tree,
                           const bodies::TetMesh& mesh, double within, double threshold,
                           const JobContext& job) {
  const double length = tree.bounds().diagonal().norm();
  // Never finer than a tenth of a thousandth of the length: the work is bounded for any
  // request.
  const double resolution = std::clamp(0.02 * within, 1e-4, 4e-4) * length;
  const double ignored = std::clamp(0.1 * within, 1e-3, 1e-2) * length;
  const GapSearch search{threshold, std::max(0.3 * within, 1e-3) * length, resolution, ignored};
  const TriangleSurface boundary = boundary_of(mesh);
  const TriangleTree boundary_tree(boundary);
  FitMeasurement result;
  OneSidedDistance there = one_sided_distance(surface, &tree, boundary_tree, search, job);
  OneSidedDistance back = one_sided_distance(boundary, nullptr, tree, search, job);
  result.fit.surface_to_mesh = there.bound;
  result.fit.mesh_to_surface = back.bound;
  result.fit.distance_share = std::max(there.bound, back.bound) / length;
  result.fit.surface_volume = check_surface(surface).volume;
  result.fit.mesh_volume = check_surface(boundary).volume;
  result.fit.share_beyond = vertices_beyond(surface, tree, boundary_tree, within * length);
  result.fit.within = within;
  result.gaps = std::move(there.gaps);
  result.gaps.insert(result.gaps.end(), back.gaps.begin(), back.gaps.end());
  return result;
}

bool has_far_part(const TriangleSurface& surface, double distance) {
  DisjointSets connected(static_cast<std::size_t>(surface.vertex_count()));
  for (int t = 0; t < surface.triangle_count(); ++t) {
    for (int c = 1; c < 3; ++c) connected.join(surface.triangles(0, t), surface.triangles(c, t));
  }
  struct Part {
    Eigen::AlignedBox3d box;
    double volume = 0;
    bool is_connected = false;
  };
  std::map<int, Part> by_lowest;
  const Vector3d origin = surface.vertices.rowwise().mean();
  for (int t = 0; t < surface.triangle_count(); ++t) {
    Part& part = by_lowest[connected.lowest(surface.triangles(0, t))];
    const auto at = [&](int c) -> Vector3d {
      return surface.vertices.col(surface.triangles(c, t)) - origin;
    };
    for (int c = 0; c < 3; ++c) part.box.extend(at(c));
    part.volume += at(0).dot(at(1).cross(at(2))) / 6;
  }
  constexpr std::size_t kMaxParts = 1000;  // pairs are compared
  if (by_lowest.size() < 2 || by_lowest.size() > kMaxParts) return false;
  std::vector<Part> parts;
  for (const auto& entry : by_lowest) parts.push_back(entry.second);
  std::swap(parts[0],
            *std::max_element(parts.begin(), parts.end(),
                              [](const Part& a, const Part& b) { return a.volume < b.volume; }));
  std::vector<std::size_t> reached = {0};
  parts[0].is_connected = true;
  for (std::size_t n = 0; n < reached.size(); ++n) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].is_connected || !parts[i].box.intersects(parts[reached[n]].box)) continue;
      parts[i].is_connected = true;
      reached.push_back(i);
    }
  }
  Eigen::AlignedBox3d all;
  for (const std::size_t i : reached) all.extend(parts[i].box);
  return std::any_of(parts.begin(), parts.end(), [&](const Part& part) {
    if (part.is_connected) return false;
    // The corner of its box that is farthest from the connected ones.
    const Vector3d beyond =
        (part.box.max() - all.max()).cwiseMax(all.min() - part.box.min()).cwiseMax(0);
    return beyond.maxCoeff() > distance;
  });
}

TriangleSurface boundary_of(const bodies::TetMesh& mesh) {
  TriangleSurface surface;
  surface.triangles = bodies::boundary_surface(mesh.tets);
  std::vector<int> compact(static_cast<std::size_t>(mesh.node_count()), -1);
  int count = 0;
  for (int& node : surface.triangles.reshaped()) {
    int& id = compact[static_cast<std::size_t>(node)];
    if (id < 0) id = count++;
    node = id;
  }
  surface.vertices.resize(3, count);
  for (int node = 0; node < mesh.node_count(); ++node) {
    const int id = compact[static_cast<std::size_t>(node)];
    if (id >= 0) surface.vertices.col(id) = mesh.nodes.col(node);
  }
  return surface;
}

}  // namespace limber::scene::lattice
