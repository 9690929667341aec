#include "engine/rods/design/patch_corners.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

using Corners = std::array<std::size_t, 4>;

constexpr double kEqualAngles = 1e-6;  // smaller differences are rounding

/// Points in the plane in which they spread most, x along the principal axis, or along the x axis
/// where there is no such.
Eigen::Matrix2Xd flattened(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(centred * centred.transpose());
  Eigen::Vector3d normal = eigen.eigenvectors().col(0);
  if (points_backward(normal)) normal = -normal;
  Eigen::Vector3d along = eigen.eigenvectors().col(2);
  const Eigen::Vector3d& spread = eigen.eigenvalues();
  if (spread[2] - spread[1] <= kEqualAngles * spread[2]) {
    constexpr double kAlmostAcross =
        0.9;  // component of the normal above which the x axis gives no direction
    const int axis = std::abs(normal.x()) < kAlmostAcross ? 0 : 1;
    along = Eigen::Vector3d::Unit(axis) - normal[axis] * normal;
    along.normalize();
  }
  Eigen::Matrix2Xd flat(2, points.cols());
  flat.row(0) = along.transpose() * centred;
  flat.row(1) = normal.cross(along).transpose() * centred;
  return flat;
}

/// Along the axes' diagonals, ascending. If a side lies across a diagonal, the end to which it goes
/// counterclockwise is taken: for each side another one.
Corners farthest_along_diagonals(const Eigen::Matrix2Xd& flat) {
  const Eigen::Vector2d size = flat.rowwise().maxCoeff() - flat.rowwise().minCoeff();
  constexpr std::array<std::array<double, 2>, 4> kDiagonals{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  Corners corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d direction(kDiagonals[k][0] / size.x(), kDiagonals[k][1] / size.y());
    const Eigen::RowVectorXd along = direction.transpose() * flat;
    const Eigen::RowVectorXd round = Eigen::RowVector2d(-direction.y(), direction.x()) * flat;
    const double farthest = along.maxCoeff() - kEqualAngles;
    Eigen::Index corner = -1;
    for (Eigen::Index i = 0; i < along.size(); ++i)
      if (along[i] >= farthest && (corner < 0 || round[i] > round[corner])) corner = i;
    corners[k] = static_cast<std::size_t>(corner);
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

/// Area that the corners enclose, in the order of the rim; 0 for fewer than four.
double enclosed_area(const Eigen::Matrix2Xd& flat, const Corners& corners) {
  if (std::adjacent_find(corners.begin(), corners.end()) != corners.end()) return 0;
  const auto between = [&](std::size_t from, std::size_t to) -> Eigen::Vector2d {
    return flat.col(static_cast<Eigen::Index>(corners[to])) -
           flat.col(static_cast<Eigen::Index>(corners[from]));
  };
  const Eigen::Vector2d one = between(0, 2), other = between(1, 3);
  return std::abs(one.x() * other.y() - one.y() * other.x()) / 2;
}

/// Is the vertex farther from the middle, or as far and farther along x, or else y, or else z?
bool farther_out(const Eigen::Vector3d& one, const Eigen::Vector3d& than) {
  const double tolerance = kEqualAngles * than.norm();
  if (std::abs(one.norm() - than.norm()) > tolerance) return one.norm() > than.norm();
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(one[axis] - than[axis]) > tolerance) return one[axis] > than[axis];
  return false;
}

double signed_area(const Eigen::Matrix2Xd& flat) {
  double twice = 0;
  for (Eigen::Index i = 0; i < flat.cols(); ++i) {
    const Eigen::Vector2d one = flat.col(i), next = flat.col((i + 1) % flat.cols());
    twice += one.x() * next.y() - one.y() * next.x();
  }
  return twice / 2;
}

/// Vertices nearest to quarters of the rim's length, but no two of them the same one, going
/// counterclockwise.
Corners quarters(const Eigen::Matrix3Xd& points, const Eigen::Matrix2Xd& flat) {
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Index count = points.cols();
  Eigen::Index begin = 0;
  for (Eigen::Index i = 1; i < count; ++i)
    if (farther_out(centred.col(i), centred.col(begin))) begin = i;
  const Eigen::Index step = signed_area(flat) < 0 ? count - 1 : 1;
  const auto place = [&](Eigen::Index i) { return (begin + i * step) % count; };
  std::vector<double> length{0};
  for (Eigen::Index i = 0; i < count; ++i)
    length.push_back(length.back() + (points.col(place(i + 1)) - points.col(place(i))).norm());
  Corners corners{static_cast<std::size_t>(begin), 0, 0, 0};
  Eigen::Index last = 0;
  for (Eigen::Index k = 1; k < 4; ++k) {
    const double target_length = static_cast<double>(k) / 4 * length.back();
    const auto missed = [&](Eigen::Index i) {
      return std::abs(length[static_cast<std::size_t>(i)] - target_length);
    };
    Eigen::Index nearest = last + 1;
    for (Eigen::Index i = last + 2; i <= count - (4 - k); ++i)
      if (missed(i) < missed(nearest) - kEqualAngles * length.back()) nearest = i;
    last = nearest;
    corners[static_cast<std::size_t>(k)] = static_cast<std::size_t>(place(last));
  }
  std::sort(corners.begin(), corners.end());
  return corners;
}

}  // namespace

bool points_backward(const Eigen::Vector3d& direction) {
  const double most = (1 - kEqualAngles) * direction.cwiseAbs().maxCoeff();
  int axis = 0;
  while (std::abs(direction[axis]) < most) ++axis;
  return direction[axis] < 0;
}

std::array<std::size_t, 4> patch_corners(const SurfaceMesh& surface, const std::vector<int>& rim) {
  const Eigen::Matrix3Xd points = surface.vertices(Eigen::all, rim);
  const Eigen::Matrix2Xd flat = flattened(points);
  constexpr int kTurns = 6;          // of a quarter of a round, after which the axes are the same
  constexpr double kClearly = 1.05;  // factor by which turned axes must enclose more
  Corners best{};
  double most = 0;
  for (int k = 0; k < kTurns; ++k) {
    const Eigen::Rotation2Dd turn(-k * std::numbers::pi / (2 * kTurns));
    const Eigen::Matrix2Xd turned = turn.toRotationMatrix() * flat;
    const Corners corners = farthest_along_diagonals(turned);
    const double area = enclosed_area(turned, corners);
    if (area <= kClearly * most) continue;
    best = corners;
    most = area;
  }
  if (most > 0) return best;
  if (rim.size() < 4) {
    throw Error(ErrorCode::kInvalidArgument, "surface.triangles",
                "the rim has fewer than four vertices");
  }
  return quarters(points, flat);
}

}  // namespace limber::rods
