#include "engine/rods/design/patch_map.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

[[noreturn]] void refuse(const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, "surface.triangles", message);
}

/// Numbers of triangles by edge, lower vertex first.
std::map<std::pair<int, int>, int> count_edges(const SurfaceMesh& surface) {
  std::map<std::pair<int, int>, int> edges;
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    if (!has_area(corners(surface, t))) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("surface.triangles[{}]", t),
                  "has no area, so that the surface cannot be spread out");
    }
    for (int k = 0; k < 3; ++k) {
      const std::pair<int, int> edge =
          std::minmax(surface.triangles(k, t), surface.triangles((k + 1) % 3, t));
      if (++edges[edge] <= 2) continue;
      refuse(fmt::format("more than two triangles share the edge of vertices {} and {}", edge.first,
                         edge.second));
    }
  }
  return edges;
}

/// Vertices of the only rim, in order.
std::vector<int> rim_of(const SurfaceMesh& surface) {
  const auto edges = count_edges(surface);
  std::map<int, std::vector<int>> next;
  std::vector<char> used(static_cast<std::size_t>(surface.vertices.cols()), 0);
  for (const auto& [edge, times] : edges) {
    for (const int vertex : {edge.first, edge.second}) used[static_cast<std::size_t>(vertex)] = 1;
    if (times == 2) continue;
    next[edge.first].push_back(edge.second);
    next[edge.second].push_back(edge.first);
  }
  if (next.empty()) refuse("the surface is closed: a grid needs a rim");
  for (const auto& [vertex, neighbours] : next) {
    if (neighbours.size() != 2) refuse(fmt::format("rims meet at vertex {}", vertex));
  }
  std::vector<int> rim{next.begin()->first};
  for (int at = next.begin()->second[0]; at != rim.front();) {
    const int before = rim.back();
    rim.push_back(at);
    at = next[at][0] == before ? next[at][1] : next[at][0];
  }
  if (rim.size() != next.size()) refuse("the surface has more than one rim: cut it or fill holes");
  const auto vertices = std::count(used.begin(), used.end(), 1);
  const auto characteristic = static_cast<std::int64_t>(vertices) -
                              static_cast<std::int64_t>(edges.size()) + surface.triangles.cols();
  // Further pieces that are closed have a rim as little as a handle has.
  if (characteristic != 1) refuse("the surface has a handle or more than one piece");
  return rim;
}

/// Where the rim's corners are, as places in it, going round.
std::array<std::size_t, 4> corners_of(const SurfaceMesh& surface, const std::vector<int>& rim) {
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(rim.size()));
  for (std::size_t i = 0; i < rim.size(); ++i)
    points.col(static_cast<Eigen::Index>(i)) = surface.vertices.col(rim[i]);
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(centred * centred.transpose());
  const Eigen::Matrix2Xd flat = eigen.eigenvectors().rightCols<2>().transpose() * centred;
  const Eigen::Vector2d size = flat.rowwise().maxCoeff() - flat.rowwise().minCoeff();
  std::array<std::size_t, 4> corners;
  constexpr std::array<std::array<double, 2>, 4> kWays{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::RowVectorXd along =
        kWays[k][0] / size.x() * flat.row(0) + kWays[k][1] / size.y() * flat.row(1);
    Eigen::Index farthest = 0;
    along.maxCoeff(&farthest);
    corners[k] = static_cast<std::size_t>(farthest);
  }
  std::sort(corners.begin(), corners.end());
  if (std::adjacent_find(corners.begin(), corners.end()) == corners.end()) return corners;
  if (rim.size() < 4) refuse("the rim has fewer than four vertices");
  for (std::size_t k = 0; k < 4; ++k) corners[k] = k * rim.size() / 4;
  return corners;
}

void place_rim(const SurfaceMesh& surface, const std::vector<int>& rim, Eigen::Matrix2Xd& map) {
  const std::array<std::size_t, 4> corners = corners_of(surface, rim);
  const Eigen::Vector2d square[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const auto vertex = [&](std::size_t place) { return rim[place % rim.size()]; };
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t begin = corners[k], end = k < 3 ? corners[k + 1] : corners[0] + rim.size();
    std::vector<double> length{0};
    for (std::size_t i = begin; i < end; ++i) {
      length.push_back(
          length.back() +
          (surface.vertices.col(vertex(i + 1)) - surface.vertices.col(vertex(i))).norm());
    }
    for (std::size_t i = begin; i < end; ++i)
      map.col(vertex(i)) =
          square[k] + length[i - begin] / length.back() * (square[(k + 1) % 4] - square[k]);
  }
}

/// Weight of the neighbour b of a: tan of half the angles at a beside it, over the distance.
Eigen::SparseMatrix<double> mean_value_weights(const SurfaceMesh& surface) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = surface.triangles(k, t);
      const Eigen::Vector3d at = surface.vertices.col(a);
      const int others[] = {surface.triangles((k + 1) % 3, t), surface.triangles((k + 2) % 3, t)};
      const Eigen::Vector3d x = surface.vertices.col(others[0]) - at,
                            y = surface.vertices.col(others[1]) - at;
      const double half = std::tan(0.5 * std::atan2(x.cross(y).norm(), x.dot(y)));
      entries.emplace_back(a, others[0], half / x.norm());
      entries.emplace_back(a, others[1], half / y.norm());
    }
  }
  Eigen::SparseMatrix<double> weights(surface.vertices.cols(), surface.vertices.cols());
  weights.setFromTriplets(entries.begin(), entries.end());
  return weights;
}

}  // namespace

Eigen::Matrix2Xd map_patch_to_square(const SurfaceMesh& surface) {
  check_surface_mesh(surface);
  const std::vector<int> rim = rim_of(surface);
  const Eigen::Index count = surface.vertices.cols();
  Eigen::Matrix2Xd map = Eigen::Matrix2Xd::Zero(2, count);
  place_rim(surface, rim, map);
  const Eigen::SparseMatrix<double> weights = mean_value_weights(surface);
  const Eigen::VectorXd sums = weights * Eigen::VectorXd::Ones(count);
  std::vector<char> fixed(static_cast<std::size_t>(count), 0);
  for (const int vertex : rim) fixed[static_cast<std::size_t>(vertex)] = 1;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index v = 0; v < count; ++v) {
    const bool free = fixed[static_cast<std::size_t>(v)] == 0 && sums[v] > 0;
    entries.emplace_back(v, v, 1);
    fixed[static_cast<std::size_t>(v)] = free ? 0 : 1;
  }
  for (Eigen::Index b = 0; b < count; ++b) {
    for (Eigen::SparseMatrix<double>::InnerIterator entry(weights, b); entry; ++entry) {
      if (fixed[static_cast<std::size_t>(entry.row())] == 0)
        entries.emplace_back(entry.row(), b, -entry.value() / sums[entry.row()]);
    }
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(matrix);
  if (factor.info() != Eigen::Success)
    throw Error(ErrorCode::kNumerical, "surface.triangles", "the patch could not be spread out");
  const Eigen::MatrixX2d rim_places = map.transpose();
  return factor.solve(rim_places).transpose();
}

}  // namespace limber::rods
