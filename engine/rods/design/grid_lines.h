#pragma once

#include <Eigen/Core>
#include <vector>

namespace limber::rods {

/// Connections in a grid of two families of rods: joint (c, r), vertex r * columns + c, is the
/// crossing of the rods of column c and row r.
struct GridLines {
  GridLines(int width, int height) : columns(width), rows(height) {
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c + 1 < columns; ++c) edges.emplace_back(at(c, r), at(c + 1, r));
    for (int c = 0; c < columns; ++c)
      for (int r = 0; r + 1 < rows; ++r) edges.emplace_back(at(c, r), at(c, r + 1));
  }
  [[nodiscard]] int at(int c, int r) const { return r * columns + c; }
  [[nodiscard]] Eigen::Index joints() const { return Eigen::Index{columns} * rows; }

  /// As line meshes have them.
  [[nodiscard]] Eigen::Matrix2Xi edge_columns() const {
    Eigen::Matrix2Xi all(2, static_cast<Eigen::Index>(edges.size()));
    for (Eigen::Index e = 0; e < all.cols(); ++e) all.col(e) = edges[static_cast<std::size_t>(e)];
    return all;
  }

  int columns, rows;
  std::vector<Eigen::Vector2i> edges;  // of rows, then of columns
};

}  // namespace limber::rods
