#include "engine/rods/design/patch_map.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/rods/design/patch_corners.h"

namespace limber::rods {
namespace {

[[noreturn]] void refuse_patch(const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, "surface.triangles", message);
}

struct PatchEdges {
  std::int64_t count = 0;
  std::vector<std::pair<int, int>> rim;  // those of one triangle, lower vertex first
};

/// Each of one or two triangles, which have areas.
PatchEdges edges_of(const SurfaceMesh& surface) {
  std::vector<std::pair<int, int>> sides;  // of triangles, lower vertex first
  sides.reserve(static_cast<std::size_t>(surface.triangles.size()));
  for (Eigen::Index t = 0; t < surface.triangles.cols(); ++t) {
    if (!has_area(corners(surface, t))) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("surface.triangles[{}]", t),
                  fmt::format("triangle {} of the surface has no area, so that the surface cannot "
                              "be spread out",
                              t));
    }
    for (int k = 0; k < 3; ++k)
      sides.emplace_back(std::minmax(surface.triangles(k, t), surface.triangles((k + 1) % 3, t)));
  }
  std::sort(sides.begin(), sides.end());
  PatchEdges edges;
  for (auto side = sides.begin(); side != sides.end();) {
    const auto next = std::upper_bound(side, std::min(side + 4, sides.end()), *side);
    if (next - side > 2) {
      refuse_patch(fmt::format("more than two triangles share the edge of vertices {} and {}",
                               side->first, side->second));
    }
    if (next - side == 1) edges.rim.push_back(*side);
    ++edges.count;
    side = next;
  }
  return edges;
}

/// Vertices of the only rim, in order.
std::vector<int> rim_of(const SurfaceMesh& surface) {
  const PatchEdges edges = edges_of(surface);
  std::map<int, std::vector<int>> next;
  for (const auto& [one, other] : edges.rim) {
    next[one].push_back(other);
    next[other].push_back(one);
  }
  std::vector<char> used(static_cast<std::size_t>(surface.vertices.cols()), 0);
  for (const int vertex : surface.triangles.reshaped()) used[static_cast<std::size_t>(vertex)] = 1;
  if (next.empty()) refuse_patch("the surface is closed: a grid needs a rim");
  for (const auto& [vertex, neighbours] : next) {
    if (neighbours.size() != 2) refuse_patch(fmt::format("rims meet at vertex {}", vertex));
  }
  std::vector<int> rim{next.begin()->first};
  for (int at = next.begin()->second[0]; at != rim.front();) {
    const int before = rim.back();
    rim.push_back(at);
    at = next[at][0] == before ? next[at][1] : next[at][0];
  }
  if (rim.size() != next.size())
    refuse_patch("the surface has more than one rim: cut it or fill holes");
  const auto vertices = std::count(used.begin(), used.end(), 1);
  const auto characteristic =
      static_cast<std::int64_t>(vertices) - edges.count + surface.triangles.cols();
  // Further pieces that are closed have a rim as little as a handle has.
  if (characteristic != 1) refuse_patch("the surface has a handle or more than one piece");
  return rim;
}

/// Length of the rim from one place in it to another, in its order.
double length_between(const SurfaceMesh& surface, const std::vector<int>& rim, std::size_t begin,
                      std::size_t end) {
  double length = 0;
  for (std::size_t i = begin; i != end; i = (i + 1) % rim.size()) {
    const int from = rim[i], to = rim[(i + 1) % rim.size()];
    length += (surface.vertices.col(to) - surface.vertices.col(from)).norm();
  }
  return length;
}

/// Is one direction longer than the other, or as long and more along x, or else y, or else between
/// two axes' forward directions rather than across?
bool comes_first(double length, const Eigen::Vector3d& direction, double than,
                 const Eigen::Vector3d& other) {
  constexpr double kEqual = 1e-6;  // relative difference that counts as rounding
  if (std::abs(length - than) > kEqual * than) return length > than;
  for (int axis = 0; axis < 2; ++axis) {
    const double share = std::abs(direction[axis]), before = std::abs(other[axis]);
    if (std::abs(share - before) > kEqual * other.norm()) return share > before;
  }
  for (const auto& [one, two] : {std::pair{0, 1}, std::pair{0, 2}, std::pair{1, 2}}) {
    const double product = direction[one] * direction[two], before = other[one] * other[two];
    if (std::abs(product - before) > kEqual * other.squaredNorm()) return product > before;
  }
  return false;
}

/// The surface alone determines the square's first corner and directions, for any order of its
/// vertices. The first direction is that of the longer sides and goes forward along the axis it is
/// nearest to, and so does the normal.
std::array<std::size_t, 4> begin_at_first(const SurfaceMesh& surface, std::vector<int>& rim) {
  std::array<std::size_t, 4> corners = patch_corners(surface, rim);
  const auto sides = [&](std::size_t k) {  // the direction along sides k and k + 2
    const auto at = [&](std::size_t corner) -> Eigen::Vector3d {
      return surface.vertices.col(rim[corners[corner % 4]]);
    };
    return Eigen::Vector3d(at(k + 1) - at(k) + at(k + 2) - at(k + 3));
  };
  const auto length = [&](std::size_t k) {
    return length_between(surface, rim, corners[k], corners[k + 1]) +
           length_between(surface, rim, corners[(k + 2) % 4], corners[(k + 3) % 4]);
  };
  if (comes_first(length(1), sides(1), length(0), sides(0)))
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
  if (points_backward(sides(0))) std::rotate(corners.begin(), corners.begin() + 2, corners.end());
  if (points_backward(sides(0).cross(sides(1)))) {
    std::reverse(rim.begin(), rim.end());
    for (std::size_t& corner : corners) corner = rim.size() - 1 - corner;
    std::reverse(corners.begin(), corners.end());
  }
  return corners;
}

void place_rim(const SurfaceMesh& surface, std::vector<int> rim, Eigen::Matrix2Xd& map) {
  const std::array<std::size_t, 4> corners = begin_at_first(surface, rim);
  const Eigen::Vector2d square[] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t begin = corners[k], end = corners[(k + 1) % 4];
    const double side = length_between(surface, rim, begin, end);
    double along = 0;
    for (std::size_t i = begin; i != end;) {
      map.col(rim[i]) = square[k] + along / side * (square[(k + 1) % 4] - square[k]);
      const std::size_t next = (i + 1) % rim.size();
      along += (surface.vertices.col(rim[next]) - surface.vertices.col(rim[i])).norm();
      i = next;
    }
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

/// Cholesky factors of the matrix with the mean of the weights of both directions. The missing part
/// of the columns' sums is added to the diagonal.
class MeanOfBothWays {
 public:
  using StorageIndex = int;
  MeanOfBothWays() = default;

  MeanOfBothWays& analyzePattern(const Eigen::SparseMatrix<double>&) { return *this; }
  MeanOfBothWays& factorize(const Eigen::SparseMatrix<double>& matrix) { return compute(matrix); }
  MeanOfBothWays& compute(const Eigen::SparseMatrix<double>& matrix) {
    const Eigen::SparseMatrix<double> turned = matrix.transpose();
    Eigen::SparseMatrix<double> mean = 0.5 * (matrix + turned);
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(matrix.cols());
    // Rows keep their sums, which are the weights of the rim: positive definite.
    const Eigen::VectorXd missing = matrix * ones - mean * ones;
    for (Eigen::Index i = 0; i < mean.cols(); ++i) mean.coeffRef(i, i) += missing[i];
    factor_.compute(mean);
    return *this;
  }
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) const {
    return factor_.solve(right);
  }
  [[nodiscard]] Eigen::ComputationInfo info() const { return factor_.info(); }

 private:
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

/// Weights of neighbours for each other differ little. Cholesky's factors take a fraction of the
/// time of those of a matrix without symmetry, which are for failures only.
Eigen::MatrixX2d solve_nearly_symmetric(const Eigen::SparseMatrix<double>& matrix,
                                        const Eigen::MatrixX2d& right) {
  constexpr int kMaxIterations = 100;  // before the matrix is factored instead
  Eigen::BiCGSTAB<Eigen::SparseMatrix<double>, MeanOfBothWays> iterations;
  iterations.setTolerance(1e-14);
  iterations.setMaxIterations(kMaxIterations);
  iterations.compute(matrix);
  if (iterations.info() == Eigen::Success) {
    constexpr double kSolved = 1e-11;  // beyond 1e-14 rounding says where it ends
    const Eigen::MatrixX2d places = iterations.solve(right);
    if ((matrix * places - right).norm() <= kSolved * right.norm()) return places;
  }
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(matrix);
  if (factor.info() != Eigen::Success)
    throw Error(ErrorCode::kNumerical, "surface.triangles", "the patch could not be spread out");
  return factor.solve(right);
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
  // Unknowns: the places of the vertices within the rim.
  constexpr int kGiven = -1;
  std::vector<int> unknown(static_cast<std::size_t>(count), 0);
  for (const int vertex : rim) unknown[static_cast<std::size_t>(vertex)] = kGiven;
  std::vector<Eigen::Index> inner;
  for (Eigen::Index v = 0; v < count; ++v) {
    int& number = unknown[static_cast<std::size_t>(v)];
    number = number != kGiven && sums[v] > 0 ? static_cast<int>(inner.size()) : kGiven;
    if (number != kGiven) inner.push_back(v);
  }
  if (inner.empty()) return map;
  const auto size = static_cast<Eigen::Index>(inner.size());
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(static_cast<std::size_t>(weights.nonZeros() + size));
  Eigen::MatrixX2d pulls = Eigen::MatrixX2d::Zero(size, 2);  // of the rim
  for (Eigen::Index b = 0; b < count; ++b) {
    const int column = unknown[static_cast<std::size_t>(b)];
    if (column != kGiven) entries.emplace_back(column, column, sums[b]);
    for (Eigen::SparseMatrix<double>::InnerIterator entry(weights, b); entry; ++entry) {
      const int row = unknown[static_cast<std::size_t>(entry.row())];
      if (row == kGiven) continue;
      if (column == kGiven) {
        pulls.row(row) += entry.value() * map.col(b).transpose();
      } else {
        entries.emplace_back(row, column, -entry.value());
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::MatrixX2d places = solve_nearly_symmetric(matrix, pulls);
  for (Eigen::Index i = 0; i < size; ++i)
    map.col(inner[static_cast<std::size_t>(i)]) = places.row(i).transpose();
  return map;
}

}  // namespace limber::rods
