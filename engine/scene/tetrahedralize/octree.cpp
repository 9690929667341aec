#include "engine/scene/tetrahedralize/octree.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::scene::lattice {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

/// Points are in units of half the smallest possible cell: all centres are whole.
constexpr int kCoordinateBits = 21;
constexpr int units_of(int level) { return 1 << (Octree::kMaxLevel + 1 - level); }

std::uint64_t pack(const Vector3i& x) {
  return static_cast<std::uint64_t>(x[0]) | static_cast<std::uint64_t>(x[1]) << kCoordinateBits |
         static_cast<std::uint64_t>(x[2]) << (2 * kCoordinateBits);
}
Vector3i unpack(std::uint64_t key) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kCoordinateBits) - 1;
  return {static_cast<int>(key & kMask), static_cast<int>(key >> kCoordinateBits & kMask),
          static_cast<int>(key >> (2 * kCoordinateBits) & kMask)};
}

/// Numbers points as they appear.
class PointIds {
 public:
  PointIds(const Octree& octree, Octree::Points& points) : octree_(octree), points_(points) {}
  int operator()(const Vector3i& units, double spacing) {
    const std::uint64_t key = pack(units);
    const auto [entry, is_new] = ids_.try_emplace(key, static_cast<int>(points_.rest.size()));
    if (is_new) {
      points_.rest.push_back(octree_.point(key));
      points_.key.push_back(key);
      points_.spacing.push_back(spacing);
    }
    auto& smallest = points_.spacing[static_cast<std::size_t>(entry->second)];
    smallest = std::min(smallest, spacing);
    return entry->second;
  }

 private:
  const Octree& octree_;
  Octree::Points& points_;
  std::unordered_map<std::uint64_t, int> ids_;
};

}  // namespace

Vector3d Octree::root_cells(const Eigen::AlignedBox3d& bounds, double cell) {
  return (bounds.sizes() / cell).array().ceil() + 2;  // a cell of margin on each side
}

Octree::Octree(const Eigen::AlignedBox3d& bounds, double root_cell) : root_cell_(root_cell) {
  const Vector3d count = root_cells(bounds, root_cell);
  if (!(count.maxCoeff() <= kMaxRootCells)) {
    throw Error(ErrorCode::kLimitExceeded, "",
                "the lattice would have more than " + std::to_string(kMaxRootCells) +
                    " cells along an axis: the body is too thin for its bounding box and the "
                    "number of tets requested");
  }
  root_count_ = count.cast<int>();
  origin_ = bounds.center() - 0.5 * root_cell * count;
}

double Octree::side(const Cell& cell) const { return std::ldexp(root_cell_, -cell.level); }

Vector3d Octree::centre(const Cell& cell) const {
  return origin_ + side(cell) * (cell.at.cast<double>() + Vector3d::Constant(0.5));
}

std::uint64_t Octree::cell_key(const Cell& cell) const {
  return pack(cell.at) | static_cast<std::uint64_t>(cell.level) << 60;  // 18 bits per coordinate
}

bool Octree::contains(const Cell& cell) const {
  return (cell.at.array() >= 0).all() &&
         (cell.at.array() < root_count_.array() * (1 << cell.level)).all();
}

Octree::Cell Octree::leaf_at(const Vector3d& x) const {
  Cell cell;
  const Vector3d place = (x - origin_) / root_cell_;
  for (cell.level = 0;; ++cell.level) {
    const Vector3d scaled = place * (1 << cell.level);
    const Vector3i last = root_count_ * (1 << cell.level) - Vector3i::Ones();
    cell.at = scaled.array().floor().max(0).min(last.cast<double>().array()).matrix().cast<int>();
    if (cell.level == kMaxLevel || !is_split(cell)) return cell;
  }
}

bool Octree::split(const Cell& leaf) {
  if (leaf.level >= kMaxLevel || is_split(leaf)) return false;
  split_unchecked(leaf);
  return true;
}

void Octree::split_unchecked(const Cell& cell) {
  if (!split_.insert(cell_key(cell)).second) return;
  if (cell.level == 0) return;
  // The cells around must be of this level at least: their parents are split.
  for (int n = 0; n < 27; ++n) {
    const Cell beside{cell.level, cell.at + Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)};
    if (!contains(beside)) continue;
    split_unchecked({cell.level - 1, Vector3i(beside.at.array() / 2)});
  }
}

void Octree::append_leaves(const Cell& cell, std::vector<Cell>& result) const {
  if (!is_split(cell)) {
    result.push_back(cell);
    return;
  }
  for (int child = 0; child < 8; ++child) {
    const Vector3i offset(child & 1, child >> 1 & 1, child >> 2);
    append_leaves({cell.level + 1, 2 * cell.at + offset}, result);
  }
}

std::vector<Octree::Cell> Octree::leaves() const {
  std::vector<Cell> result;
  for (int z = 0; z < root_count_[2]; ++z) {
    for (int y = 0; y < root_count_[1]; ++y) {
      for (int x = 0; x < root_count_[0]; ++x) append_leaves({0, Vector3i(x, y, z)}, result);
    }
  }
  return result;
}

std::uint64_t Octree::point_key(const Cell& cell, int corner) const {
  const int units = units_of(cell.level);
  if (corner < 0) return pack(units * cell.at + Vector3i::Constant(units / 2));
  return pack(units * (cell.at + Vector3i(corner & 1, corner >> 1 & 1, corner >> 2)));
}

Vector3d Octree::point(std::uint64_t key) const {
  return origin_ + root_cell_ / units_of(0) * unpack(key).cast<double>();
}

std::vector<BackgroundTet> Octree::tets(const std::vector<Cell>& leaves,
                                        const std::vector<char>& is_used, Points& points) const {
  std::unordered_set<std::uint64_t> used;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    if (is_used[i]) used.insert(cell_key(leaves[i]));
  }
  PointIds id(*this, points);
  std::vector<BackgroundTet> result;
  const auto add_face = [&](const Cell& cell, int axis, int sign) {
    const Cell beside{cell.level, cell.at + sign * Vector3i::Unit(axis)};
    if (!contains(beside)) return;
    const bool beside_is_split = is_split(beside);
    // A larger neighbour looks at this face itself.
    const bool beside_exists =
        cell.level == 0 || is_split({cell.level - 1, Vector3i(beside.at.array() / 2)});
    if (!beside_exists || (!beside_is_split && sign < 0)) return;
    const double size = side(cell);
    const int units = units_of(cell.level), half = units / 2;
    const Vector3i middle = units * cell.at + Vector3i::Constant(half);
    const Vector3i face = middle + sign * half * Vector3i::Unit(axis);
    const Vector3i u = half * Vector3i::Unit((axis + 1) % 3),
                   v = half * Vector3i::Unit((axis + 2) % 3);
    const Vector3i ring[4] = {face + u + v, face - u + v, face - u - v, face + u - v};
    const Vector3i outward[4] = {v, -u, -v, u};  // from the face to the middle of an edge of it
    for (int side = 0; side < 4; ++side) {
      const Vector3i a = ring[side], b = ring[(side + 1) % 4], edge = face + outward[side];
      if (!beside_is_split) {
        const Vector3i across = outward[side] / half;
        const Cell over[2] = {{cell.level, cell.at + across}, {cell.level, beside.at + across}};
        const bool edge_is_split =
            std::any_of(over, over + 2, [&](const Cell& c) { return contains(c) && is_split(c); });
        const int p = id(middle, size);
        const int q = id(middle + sign * units * Vector3i::Unit(axis), size);
        const int ia = id(a, size), ib = id(b, size);
        if (edge_is_split) {
          const int m = id(edge, size / 2);
          result.push_back({p, q, ia, m});
          result.push_back({p, q, m, ib});
        } else {
          result.push_back({p, q, ia, ib});
        }
        continue;
      }
      // Halves of the two small squares' triangles next to this edge, seen from both sides.
      const int p = id(middle, size), f = id(face, size / 2), m = id(edge, size / 2);
      for (const Vector3i& end : {a, b}) {
        const Vector3i small = (face + end) / 2 + sign * half / 2 * Vector3i::Unit(axis);
        const int e = id(end, size / 2), q = id(small, size / 2);
        result.push_back({p, f, m, e});
        result.push_back({q, f, m, e});
      }
    }
  };
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    const Cell& cell = leaves[i];
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        if (!is_used[i]) {
          const Cell beside{cell.level, cell.at + sign * Vector3i::Unit(axis)};
          if (!contains(beside)) continue;
          if (!is_split(beside) && used.count(cell_key(beside)) == 0) continue;
        }
        add_face(cell, axis, sign);
      }
    }
  }
  return result;
}

}  // namespace limber::scene::lattice
