#include "engine/scene/tetrahedralize/graded_lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;

/// A point is moved onto the surface if that is nearer than this share of its smallest cell. These
/// are the bounds of Labelle and Shewchuk for uniform cells: along edges between centres or corners
/// (of one cell side), and between a centre and a corner (of 0.866).
constexpr double kGradedSnapLong = 0.24999;
constexpr double kGradedSnapShort = 0.41189 * 0.8660254;

double six_volumes(const std::vector<Vector3d>& x, const BackgroundTet& tet) {
  const auto at = [&](std::size_t c) { return x[static_cast<std::size_t>(tet[c])]; };
  return (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0));
}

/// Points of a large cell may move farther than its small neighbour tets permit: these moves are
/// undone.
void undo_inversions(const std::vector<BackgroundTet>& tets, const Octree::Points& points,
                     const std::vector<double>& original, std::vector<double>& values,
                     std::vector<Vector3d>& positions) {
  constexpr double kMinVolumeRatio = 0.05;
  for (bool changed = true; changed;) {
    changed = false;
    for (const BackgroundTet& tet : tets) {
      bool is_inside = false, has_moved = false;
      for (const int p : tet) {
        is_inside |= values[static_cast<std::size_t>(p)] < 0;
        has_moved |= values[static_cast<std::size_t>(p)] == 0;
      }
      if (!is_inside || !has_moved) continue;
      if (six_volumes(positions, tet) / six_volumes(points.rest, tet) > kMinVolumeRatio) continue;
      for (const int corner : tet) {
        const auto p = static_cast<std::size_t>(corner);
        if (values[p] != 0 || original[p] == 0) continue;
        values[p] = original[p];
        positions[p] = points.rest[p];
        changed = true;
      }
    }
  }
}

}  // namespace

GradedLattice::GradedLattice(const ImplicitSolid& solid, double root_cell)
    : solid_(solid),
      root_cell_(root_cell),
      octree_(solid.bounds, root_cell),
      cutter_(solid, 1e-6 * root_cell) {}

double GradedLattice::value(std::uint64_t point) {
  const auto [entry, is_new] = values_.try_emplace(point, 0.0);
  if (is_new) entry->second = cutter_.value(octree_.point(point));
  return entry->second;
}

Stuffing GradedLattice::stuff(std::size_t max_leaves, const JobContext& job) {
  const std::vector<Octree::Cell> leaves = octree_.leaves();
  if (leaves.size() > max_leaves) {
    throw Error(ErrorCode::kLimitExceeded, "",
                "the lattice would have more than " + std::to_string(max_leaves) + " cells");
  }
  // Leaves that the surface cannot reach have corners of the sign of their centre.
  std::vector<char> is_used(leaves.size(), 0);
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    if (i % 256 == 0) job.throw_if_cancelled();
    const double f = value(octree_.point_key(leaves[i]));
    const double reach = 0.8661 * octree_.side(leaves[i]) * solid_.lipschitz;
    is_used[i] = f < reach ? 1 : 0;
    if (std::abs(f) >= reach) continue;
    for (int corner = 0; corner < 8; ++corner) {
      static_cast<void>(value(octree_.point_key(leaves[i], corner)));
    }
  }
  Octree::Points points;
  std::vector<BackgroundTet> tets = octree_.tets(leaves, is_used, points);
  job.throw_if_cancelled();
  // Points without a value are corners, middles of edges and of faces: near ones get theirs below.
  std::vector<double> values(points.rest.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t p = 0; p < values.size(); ++p) {
    if (p % 256 == 0) job.throw_if_cancelled();
    const auto known = values_.find(points.key[p]);
    if (known != values_.end()) values[p] = known->second;
  }
  for (const BackgroundTet& tet : tets) {
    // Centres always have a value, and each tet has one as its first corner.
    const double f = values[static_cast<std::size_t>(tet[0])];
    for (const int corner : tet) {
      double& g = values[static_cast<std::size_t>(corner)];
      if (!std::isnan(g)) continue;
      const auto p = static_cast<std::size_t>(corner);
      const double reach = (points.rest[p] - points.rest[static_cast<std::size_t>(tet[0])]).norm() *
                           solid_.lipschitz;
      g = std::abs(f) > reach ? f : value(points.key[p]);
    }
  }
  job.throw_if_cancelled();
  std::vector<Vector3d> positions = points.rest;
  snap(tets, points, values, positions);
  job.throw_if_cancelled();
  Stencils stencils(cutter_);
  for (const BackgroundTet& tet : tets) {
    std::array<Corner, 4> corners;
    bool is_inside = false;
    for (std::size_t c = 0; c < 4; ++c) {
      const auto p = static_cast<std::size_t>(tet[c]);
      corners[c] = {tet[c], values[p], points.rest[p], positions[p]};
      is_inside |= values[p] < 0;
    }
    if (is_inside) stencils.add(corners);
  }
  return stencils.take();
}

void GradedLattice::snap(const std::vector<BackgroundTet>& tets, const Octree::Points& points,
                         std::vector<double>& values, std::vector<Vector3d>& positions) const {
  const std::vector<double> original = values;
  std::vector<std::pair<int, int>> edges;
  for (const BackgroundTet& tet : tets) {
    for (const int p : tet) {
      for (const int q : tet) {
        const double f = values[static_cast<std::size_t>(p)],
                     g = values[static_cast<std::size_t>(q)];
        if (p != q && f != 0 && g != 0 && (f < 0) != (g < 0)) edges.emplace_back(p, q);
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    const auto p = static_cast<std::size_t>(edges[begin].first);
    double nearest = std::numeric_limits<double>::infinity();
    Vector3d target = Vector3d::Zero();
    for (; end < edges.size() && edges[end].first == edges[begin].first; ++end) {
      const auto q = static_cast<std::size_t>(edges[end].second);
      if (values[q] == 0 || values[p] == 0) continue;
      const double t = cutter_.cut(points.rest[p], values[p], points.rest[q], values[q]);
      const Vector3d edge = points.rest[q] - points.rest[p];
      // Edges along an axis are the long ones.
      const double along = edge.cwiseAbs().maxCoeff() / edge.norm();
      const double limit = (along > 0.99 ? kGradedSnapLong : kGradedSnapShort) * points.spacing[p];
      const double length = t * edge.norm();
      if (length >= limit || length >= nearest) continue;
      nearest = length;
      target = points.rest[p] + t * edge;
    }
    if (!std::isfinite(nearest)) continue;
    positions[p] = target;
    values[p] = 0;
  }
  undo_inversions(tets, points, original, values, positions);
}

}  // namespace limber::scene::lattice
