#include "engine/bodies/node_merging.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "engine/base/error.h"

namespace limber::bodies {
namespace {

using Cell = std::array<std::int64_t, 3>;

struct CellHash {
  std::size_t operator()(const Cell& cell) const noexcept {
    std::uint64_t hash = 0x9e3779b97f4a7c15u;
    for (const std::int64_t index : cell) {
      hash = (hash ^ static_cast<std::uint64_t>(index)) * 0xff51afd7ed558ccdu;
      hash ^= hash >> 32;
    }
    return static_cast<std::size_t>(hash);
  }
};

/// Representatives found so far, by cubic cells not smaller than the tolerance.
class RepresentativeGrid {
 public:
  RepresentativeGrid(const NodePositions& nodes, double tolerance)
      : nodes_(nodes), tolerance_(tolerance), origin_(nodes.rowwise().minCoeff()) {
    const double extent = (nodes.rowwise().maxCoeff() - origin_).maxCoeff();
    // Cell indices must fit: at most a million cells per axis more than the nodes can tell apart.
    cell_size_ = std::max({tolerance, 1e-9 * extent, 1e-300});
  }

  /// Lowest representative within the tolerance, or -1.
  int find(int node) const {
    const Cell centre = cell_of(node);
    int found = -1;
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      for (std::int64_t dy = -1; dy <= 1; ++dy) {
        for (std::int64_t dz = -1; dz <= 1; ++dz) {
          const auto bucket = cells_.find({centre[0] + dx, centre[1] + dy, centre[2] + dz});
          if (bucket == cells_.end()) continue;
          for (const int other : bucket->second) {
            const double distance = (nodes_.col(other) - nodes_.col(node)).norm();
            if (distance <= tolerance_ && (found < 0 || other < found)) found = other;
          }
        }
      }
    }
    return found;
  }

  void add(int node) { cells_[cell_of(node)].push_back(node); }

 private:
  Cell cell_of(int node) const {
    Cell cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] = static_cast<std::int64_t>((nodes_(axis, node) - origin_[axis]) / cell_size_);
    }
    return cell;
  }

  const NodePositions& nodes_;
  double tolerance_;
  Eigen::Vector3d origin_;
  double cell_size_;
  std::unordered_map<Cell, std::vector<int>, CellHash> cells_;
};

}  // namespace

std::vector<int> merge_near_nodes(const NodePositions& nodes, double tolerance) {
  LIMBER_DEMAND(tolerance >= 0);
  std::vector<int> representative(static_cast<std::size_t>(nodes.cols()));
  if (nodes.cols() == 0) return representative;
  RepresentativeGrid grid(nodes, tolerance);
  for (int node = 0; node < nodes.cols(); ++node) {
    const int found = grid.find(node);
    representative[static_cast<std::size_t>(node)] = found < 0 ? node : found;
    if (found < 0) grid.add(node);
  }
  return representative;
}

}  // namespace limber::bodies
