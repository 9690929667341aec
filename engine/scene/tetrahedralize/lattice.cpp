// Isosurface stuffing with one cell size (F. Labelle, J. R. Shewchuk: Isosurface stuffing: fast
// tetrahedral meshes with good dihedral angles, SIGGRAPH 2007, sections 2 and 3).
#include "engine/scene/tetrahedralize/lattice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// A point is moved onto the surface when the surface cuts an edge nearer to it than this fraction
/// of the edge
/// ("safe" values of the paper, which bound all dihedral angles by 10.7 and 164.8 degrees).
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
      : solid_(solid), half_(cell / 2) {
    if (!(lattice_points(solid, cell) < max_points)) {
      throw Error(ErrorCode::kLimitExceeded, "",
                  "the lattice would have more than " + std::to_string(max_points) +
                      " points: the body is too thin for its bounding box and the number of tets "
                      "asked for");
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
  [[nodiscard]] double at(const Vector3d& x) const {
    const double f = solid_.distance(x);
    if (!std::isfinite(f))
      throw Error(ErrorCode::kInvalidArgument, "", "the distance function is not finite");
    return f;
  }

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

  [[nodiscard]] Vector3d position(int point, const Vector3i& d) const {
    const auto moved = moved_.find(point);
    return moved == moved_.end() ? lattice_position(d) : moved->second;
  }

  /// Where the surface cuts the edge from p (value fp) to q (fq, of the other sign), as a fraction
  /// from p: regula falsi with the Illinois rule, so that kinks of a blended function cannot stall
  /// it.
  [[nodiscard]] double cut(const Vector3d& p, double fp, const Vector3d& q, double fq) const {
    double a = 0, b = 1, fa = fp, fb = fq;
    int side = 0;
    double t = fa / (fa - fb);
    for (int iteration = 0; iteration < 12; ++iteration) {
      const double f = at(p + t * (q - p));
      if (std::abs(f) < 1e-4 * half_ * solid_.lipschitz) break;
      if ((f < 0) == (fa < 0)) {
        a = t;
        fa = f;
        if (side == 1) fb /= 2;
        side = 1;
      } else {
        b = t;
        fb = f;
        if (side == 2) fa /= 2;
        side = 2;
      }
      t = a + (b - a) * fa / (fa - fb);
    }
    return std::clamp(t, 1e-6, 1 - 1e-6);
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
    const double f_middle = at(middle);
    const bool far = std::abs(f_middle) > reach;
    for (int z = begin[2]; z < end[2]; ++z) {
      for (int y = begin[1] + ((begin[1] ^ z) & 1); y < end[1]; y += 2) {
        for (int x = begin[0] + ((begin[0] ^ z) & 1); x < end[0]; x += 2) {
          const Vector3i d(x, y, z);
          value_[static_cast<std::size_t>(index(d))] = far ? f_middle : at(lattice_position(d));
        }
      }
    }
  }

  const ImplicitSolid& solid_;
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
      const double t = lattice.cut(p, f, q, g);
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

/// Turns lattice tets into output tets: the stencils of the paper's figure 3.
class Stencils {
 public:
  explicit Stencils(const Lattice& lattice) : lattice_(lattice) {}

  void add(const std::array<Vector3i, 4>& corners) {
    std::array<Corner, 4> all;
    Corner inside[4], outside[4], on[4];
    int in = 0, out = 0, zero = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      all[i] = {corners[i], lattice_.index(corners[i]), 0};
      all[i].value = lattice_.value(all[i].point);
      if (all[i].value < 0) {
        // Quadrilaterals are shared with neighbours: their diagonal starts at the first inside
        // corner of one global order.
        int place = in++;
        for (; place > 0 && inside[place - 1].point > all[i].point; --place) {
          inside[place] = inside[place - 1];
        }
        inside[place] = all[i];
      } else if (all[i].value > 0) {
        outside[out++] = all[i];
      } else {
        on[zero++] = all[i];
      }
    }
    if (in == 0) return;
    if (out == 0) {
      emit(node(all[0]), node(all[1]), node(all[2]), node(all[3]));
    } else if (in == 1) {
      int rest[3], n = 0;
      for (int i = 0; i < zero; ++i) rest[n++] = node(on[i]);
      for (int i = 0; i < out; ++i) rest[n++] = cut(inside[0], outside[i]);
      emit(node(inside[0]), rest[0], rest[1], rest[2]);
    } else if (in == 2 && out == 1) {
      const int a = node(inside[0]), b = node(inside[1]), z = node(on[0]);
      const int a_cut = cut(inside[0], outside[0]), b_cut = cut(inside[1], outside[0]);
      emit(a, b, b_cut, z);
      emit(a, b_cut, a_cut, z);
    } else if (in == 2) {
      add_two_and_two(inside, outside);
    } else {
      const int a = node(inside[0]), b = node(inside[1]), c = node(inside[2]);
      const int a_cut = cut(inside[0], outside[0]), b_cut = cut(inside[1], outside[0]);
      const int c_cut = cut(inside[2], outside[0]);
      emit(a, b, c, c_cut);
      emit(a, b, b_cut, c_cut);
      emit(a, a_cut, b_cut, c_cut);
    }
  }

  Stuffing take() { return std::move(result_); }

 private:
  struct Corner {
    Vector3i d;
    int point;
    double value;
  };

  void add_two_and_two(const Corner* inside, const Corner* outside) {
    const int a = node(inside[0]), b = node(inside[1]);
    const int a_n = cut(inside[0], outside[0]), a_m = cut(inside[0], outside[1]);
    const int b_n = cut(inside[1], outside[0]), b_m = cut(inside[1], outside[1]);
    emit(a, b, b_n, b_m);
    // What is left is a pyramid over the cut itself, which no neighbour shares: take the shorter
    // diagonal.
    if (squared(a_n, b_m) <= squared(a_m, b_n)) {
      emit(a, a_n, b_m, a_m);
      emit(a, a_n, b_m, b_n);
    } else {
      emit(a, a_m, b_n, a_n);
      emit(a, a_m, b_n, b_m);
    }
  }

  [[nodiscard]] const Vector3d& at(int id) const {
    return result_.nodes[static_cast<std::size_t>(id)];
  }
  [[nodiscard]] double squared(int a, int b) const { return (at(a) - at(b)).squaredNorm(); }

  int add_node(const Vector3d& x) {
    result_.nodes.push_back(x);
    return static_cast<int>(result_.nodes.size()) - 1;
  }

  int node(const Corner& corner) {
    const auto [entry, is_new] = points_.try_emplace(corner.point, -1);
    if (is_new) entry->second = add_node(lattice_.position(corner.point, corner.d));
    return entry->second;
  }

  int cut(const Corner& inside, const Corner& outside) {
    const std::uint64_t key =
        static_cast<std::uint64_t>(inside.point) << 32 | static_cast<std::uint32_t>(outside.point);
    const auto [entry, is_new] = cuts_.try_emplace(key, -1);
    if (is_new) {
      // Points beside a cut have not moved: moved ones lie on the surface and cut nothing.
      const Vector3d p = lattice_.lattice_position(inside.d),
                     q = lattice_.lattice_position(outside.d);
      entry->second = add_node(p + lattice_.cut(p, inside.value, q, outside.value) * (q - p));
    }
    return entry->second;
  }

  void emit(int a, int b, int c, int d) {
    const double volume = (at(b) - at(a)).cross(at(c) - at(a)).dot(at(d) - at(a));
    result_.tets.emplace_back(a, b, volume >= 0 ? c : d, volume >= 0 ? d : c);
  }

  const Lattice& lattice_;
  Stuffing result_;
  std::unordered_map<int, int> points_;
  std::unordered_map<std::uint64_t, int> cuts_;
};

}  // namespace

double lattice_points(const ImplicitSolid& solid, double cell) {
  const Vector3d cells = cells_across(solid, cell);
  return (cells.array() + 1).prod() + cells.prod();
}

Stuffing stuff(const ImplicitSolid& solid, double cell, const Vector3d& phase,
               int max_lattice_points, const JobContext& job) {
  Lattice lattice(solid, cell, phase, max_lattice_points);
  lattice.sample(job);
  snap_points(lattice, job);
  Stencils stencils(lattice);
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
            stencils.add({centre, next, ring[side], ring[(side + 1) % 4]});
        }
      }
    }
  }
  return stencils.take();
}

}  // namespace limber::scene::lattice
