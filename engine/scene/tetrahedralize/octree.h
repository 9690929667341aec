#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace limber::scene::lattice {

/// Corners of a background tet: ids of points.
using BackgroundTet = std::array<int, 4>;

/// A grid of cubes, cubes split into eight where asked, and split further until cells that share a
/// corner differ by one level at most. Its leaves make a lattice of tets (Labelle and Shewchuk
/// 2007, section 4): body-centred cubic between leaves of one size, bisected tets at split edges,
/// halved pyramids between a small leaf and a large one.
class Octree {
 public:
  static constexpr int kMaxLevel = 9;
  static constexpr int kMaxRootCells = 512;  // along an axis

  struct Cell {
    int level = 0;
    Eigen::Vector3i at = {0, 0, 0};  // in cells of its level
  };
  struct Points {
    std::vector<Eigen::Vector3d> rest;
    std::vector<std::uint64_t> key;
    std::vector<double> spacing;  // side of the smallest leaf that has the point
  };

  /// @param root_cell  side of a cell that is not split [length unit]
  Octree(const Eigen::AlignedBox3d& bounds, double root_cell);

  [[nodiscard]] static Eigen::Vector3d root_cells(const Eigen::AlignedBox3d& bounds, double cell);

  [[nodiscard]] double side(const Cell& cell) const;
  [[nodiscard]] Eigen::Vector3d centre(const Cell& cell) const;
  /// The leaf that holds x; x outside of the grid counts as at its rim.
  [[nodiscard]] Cell leaf_at(const Eigen::Vector3d& x) const;
  /// Splits the leaf and larger neighbours. @returns whether it was a leaf that could be split.
  bool split(const Cell& leaf);
  /// All leaves, in an order that depends on the tree only.
  [[nodiscard]] std::vector<Cell> leaves() const;

  /// Key of a leaf's centre (corner < 0) or of one of its eight corners (bits: x, y, z).
  [[nodiscard]] std::uint64_t point_key(const Cell& cell, int corner = -1) const;
  [[nodiscard]] Eigen::Vector3d point(std::uint64_t key) const;

  /// The lattice tets around leaves for which `is_used` holds or whose neighbour's does; points are
  /// numbered as they appear.
  [[nodiscard]] std::vector<BackgroundTet> tets(const std::vector<Cell>& leaves,
                                                const std::vector<char>& is_used,
                                                Points& points) const;

 private:
  [[nodiscard]] std::uint64_t cell_key(const Cell& cell) const;
  [[nodiscard]] bool contains(const Cell& cell) const;
  [[nodiscard]] bool is_split(const Cell& cell) const {
    return split_.find(cell_key(cell)) != split_.end();
  }
  void append_leaves(const Cell& cell, std::vector<Cell>& result) const;
  void split_unchecked(const Cell& cell);

  Eigen::Vector3i root_count_;
  double root_cell_;
  Eigen::Vector3d origin_;
  std::unordered_set<std::uint64_t> split_;
};

}  // namespace limber::scene::lattice
