// Isosurface stuffing with one cell size (F. Labelle, J. R. Shewchuk: Isosurface stuffing: fast
// tetrahedral meshes with good dihedral angles, SIGGRAPH 2007, sections 2 and 3).
#include "engine/scene/tetrahedralize/lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "engine/scene/tetrahedralize/stencils.h"

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// A point is moved onto the surface if the surface cuts an edge nearer to it than this fraction of
/// the edge. These are the "safe" values of the paper, which bound all dihedral angles by 10.7 and
/// 164.8 degrees.
constexpr double kSnapLong = 0.24999;
constexpr double kSnapShort = 0.41189;

/// Cells along each axis: a margin of more than a cell on each side keeps the outermost points
/// outside.
Vector3d cells_across(const ImplicitSolid& solid, double cell) {
  return (solid.bounds.sizes() / cell).array().ceil() + 4;
}

/// Body-centred cubic lattice: corners (i, j, k) of cells and their centres, in doubled integer
/// coordinates: corners are all even, centres all odd.
class Lattice {
 public:
  Lattice(const ImplicitSolid& solid, double cell, const Vector3d& phase, int max_points)
      : solid_(solid), cutter_(solid, 1e-4 * cell / 2), half_(cell / 2) {
    if (!(lattice_points(solid, cell) < max_points)) {
      throw Error(ErrorCode::kLimitExceeded, "",
                  "the lattice would have more than " + std::to_string(max_points) +
                      " points: the body is too thin for its bounding box and the number of tets "
                      "requested");
    }
    cells_ = cells_across(solid, cell).cast<int>();
    origin_ = solid.bounds.center() + cell * phase - half_ * cells_.cast<double>();
    points_per_row_ = cells_ + Vector3i::Ones();
    corner_count_ = points_per_row_.prod();
    const int count = corner_count_ + cells_.prod();
    value_.assign(static_cast<std::size_t>(count), 0.0);
  }

  [[nodiscard]] const Vector3i& cells() const { return cells_; }
  [[nodiscard]] int count() const { return static_cast<int>(value_.size()); }

  /// Index of the point at doubled coordinates d (all even or all odd, inside).
  [[nodiscard]] int index(const Vector3i& d) const {
    const Vector3i h(d[0] >> 1, d[1] >> 1, d[2] >> 1);
    if ((d[0] & 1) == 0) return (h[2] * points_per_row_[1] + h[1]) * points_per_row_[0] + h[0];
    return corner_count_ + (h[2] * cells_[1] + h[1]) * cells_[0] + h[0];
  }
  [[nodiscard]] bool contains(const Vector3i& d) const {
    return (d.array() >= 0).all() && (d.array() <= 2 * cells_.array()).all();
  }
  [[nodiscard]] Vector3d lattice_position(const Vector3i& d) const {
    return origin_ + half_ * d.cast<double>();
  }

  [[nodiscard]] double value(int point) const { return value_[static_cast<std::size_t>(point)]; }
  /// Evaluates the function at all points; blocks that the Lipschitz bound shows to be wholly in or
  /// out are filled.
  void sample(const JobContext& job) {
    constexpr int kBlock = 8;  // in doubled coordinates: 4 cells
    for (int z = 0; z <= 2 * cells_[2]; z += kBlock) {
      for (int y = 0; y <= 2 * cells_[1]; y += kBlock) {
        job.throw_if_cancelled();
        for (int x = 0; x <= 2 * cells_[0]; x += kBlock) sample_block(Vector3i(x, y, z), kBlock);
      }
    }
    check_outermost();
  }

  [[nodiscard]] const SurfaceCutter& cutter() const { return cutter_; }
  [[nodiscard]] Corner corner(const Vector3i& d) const {
    const int point = index(d);
    const Vector3d rest = lattice_position(d);
    const auto moved = moved_.find(point);
    return {point, value(point), rest, moved == moved_.end() ? rest : moved->second};
  }

  void move(int point, const Vector3d& x) {
    moved_[point] = x;
    value_[static_cast<std::size_t>(point)] = 0;
  }

 private:
  /// A body that reaches beyond its box would be left open there.
  void check_outermost() const {
    const Vector3i end = 2 * cells_;
    for (int z = 0; z <= end[2]; z += 2) {
      for (int y = 0; y <= end[1]; y += 2) {
        const bool rim = z == 0 || y == 0 || z == end[2] || y == end[1];
        for (int x = 0; x <= end[0]; x += rim ? 2 : end[0]) {
          if (value(index(Vector3i(x, y, z))) <= 0) {
            throw Error(ErrorCode::kInvalidArgument, "",
                        "the solid reaches beyond its bounding box");
          }
        }
      }
    }
  }

  void sample_block(const Vector3i& begin, int size) {
    const Vector3i end = (begin.array() + size).min(2 * cells_.array() + 1);
    const Vector3d middle =
        origin_ + half_ * (0.5 * (begin + end).cast<double>() - Vector3d::Constant(0.5));
    // The +2 keeps a layer of exactly evaluated points around the surface.
    const double reach = half_ * std::sqrt(3.0) * (0.5 * size + 2) * solid_.lipschitz;
    const double f_middle = cutter_.value(middle);
    const bool far = std::abs(f_middle) > reach;
    for (int z = begin[2]; z < end[2]; ++z) {
      for (int y = begin[1] + ((begin[1] ^ z) & 1); y < end[1]; y += 2) {
        for (int x = begin[0] + ((begin[0] ^ z) & 1); x < end[0]; x += 2) {
          const Vector3i d(x, y, z);
          value_[static_cast<std::size_t>(index(d))] =
              far ? f_middle : cutter_.value(lattice_position(d));
        }
      }
    }
  }

  const ImplicitSolid& solid_;
  SurfaceCutter cutter_;
  double half_;
  Vector3d origin_;
  Vector3i cells_, points_per_row_;
  int corner_count_ = 0;
  std::vector<double> value_;
  std::unordered_map<int, Vector3d> moved_;
};

/// The fourteen neighbours of a point: six at distance 1 along axes (long edges), eight at
/// sqrt(3)/2 (short).
std::array<Vector3i, 14> neighbours() {
  std::array<Vector3i, 14> result;
  std::size_t n = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {-2, 2}) result[n++] = sign * Vector3i::Unit(axis);
  }
  for (int corner = 0; corner < 8; ++corner) {
    result[n++] = Vector3i(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
  }
  return result;
}

template <typename Visit>
void for_each_point(const Lattice& lattice, const Visit& visit) {
  const Vector3i end = 2 * lattice.cells();
  for (int z = 0; z <= end[2]; ++z) {
    for (int y = z & 1; y <= end[1]; y += 2) {
      for (int x = z & 1; x <= end[0]; x += 2) visit(Vector3i(x, y, z));
    }
  }
}

/// Moves every point that the surface comes too near to onto the nearest cut of its edges.
void snap_points(Lattice& lattice, const JobContext& job) {
  static const std::array<Vector3i, 14> kNeighbours = neighbours();
  int row = 0;
  for_each_point(lattice, [&](const Vector3i& d) {
    if (++row % 4096 == 0) job.throw_if_cancelled();
    const int point = lattice.index(d);
    const double f = lattice.value(point);
    if (f == 0) return;
    double nearest = std::numeric_limits<double>::infinity();
    Vector3d target = Vector3d::Zero();
    for (std::size_t n = 0; n < kNeighbours.size(); ++n) {
      const Vector3i e = d + kNeighbours[n];
      if (!lattice.contains(e)) continue;
      const double g = lattice.value(lattice.index(e));
      if (g == 0 || (f < 0) == (g < 0)) continue;
      const Vector3d p = lattice.lattice_position(d), q = lattice.lattice_position(e);
      const double t = lattice.cutter().cut(p, f, q, g);
      if (t >= (n < 6 ? kSnapLong : kSnapShort)) continue;
      const double length = t * (q - p).norm();
      if (length < nearest) {
        nearest = length;
        target = p + t * (q - p);
      }
    }
    if (nearest < std::numeric_limits<double>::infinity()) lattice.move(point, target);
  });
}

void add_tet(Stencils& stencils, const Lattice& lattice, const std::array<Vector3i, 4>& corners) {
  const auto is_inside = [&](const Vector3i& d) { return lattice.value(lattice.index(d)) < 0; };
  if (std::none_of(corners.begin(), corners.end(), is_inside)) return;
  stencils.add({lattice.corner(corners[0]), lattice.corner(corners[1]), lattice.corner(corners[2]),
                lattice.corner(corners[3])});
}

}  // namespace

bodies::TetMesh as_mesh(const Stuffing& stuffing) {
  bodies::TetMesh mesh;
  mesh.nodes.resize(3, static_cast<Eigen::Index>(stuffing.nodes.size()));
  for (std::size_t i = 0; i < stuffing.nodes.size(); ++i) {
    mesh.nodes.col(static_cast<Eigen::Index>(i)) = stuffing.nodes[i];
  }
  mesh.tets.resize(4, static_cast<Eigen::Index>(stuffing.tets.size()));
  for (std::size_t t = 0; t < stuffing.tets.size(); ++t) {
    mesh.tets.col(static_cast<Eigen::Index>(t)) = stuffing.tets[t];
  }
  return mesh;
}

double lattice_points(const ImplicitSolid& solid, double cell) {
  const Vector3d cells = cells_across(solid, cell);
  return (cells.array() + 1).prod() + cells.prod();
}

Stuffing stuff(const ImplicitSolid& solid, double cell, const Vector3d& phase,
               int max_lattice_points, const JobContext& job) {
  Lattice lattice(solid, cell, phase, max_lattice_points);
  lattice.sample(job);
  snap_points(lattice, job);
  Stencils stencils(lattice.cutter());
  // Every lattice tet has one edge between the centres of two cells and one edge of the face
  // between those cells.
  const Vector3i cells = lattice.cells();
  for (int k = 0; k < cells[2]; ++k) {
    job.throw_if_cancelled();
    for (int j = 0; j < cells[1]; ++j) {
      for (int i = 0; i < cells[0]; ++i) {
        const Vector3i centre(2 * i + 1, 2 * j + 1, 2 * k + 1);
        for (int axis = 0; axis < 3; ++axis) {
          const Vector3i next = centre + 2 * Vector3i::Unit(axis);
          if (next[axis] > 2 * cells[axis]) continue;
          const Vector3i u = Vector3i::Unit((axis + 1) % 3), v = Vector3i::Unit((axis + 2) % 3);
          const Vector3i middle = centre + Vector3i::Unit(axis);
          const Vector3i ring[4] = {middle + u + v, middle - u + v, middle - u - v, middle + u - v};
          for (int side = 0; side < 4; ++side)
            add_tet(stencils, lattice, {centre, next, ring[side], ring[(side + 1) % 4]});
        }
      }
    }
  }
  return stencils.take();
}

}  // namespace limber::scene::lattice
