#include "engine/rods/design/patch_lift.h"

#include <Eigen/LU>
#include <limits>
#include <unsupported/Eigen/BVH>
#include <vector>

#include "engine/rods/design/patch_map.h"

namespace limber::rods {
namespace {

using ImageBoxes = Eigen::KdBVH<double, 2, int>;

constexpr double kSquareRounding =
    1e-9;  // of the square's side: triangles beside a point count as well

}  // namespace

struct PatchLift::Impl {
  explicit Impl(const SurfaceMesh& given) : surface(given), map(map_patch_to_square(given)) {
    std::vector<int> triangles;
    std::vector<ImageBoxes::Volume> volumes;
    for (int t = 0; t < surface.triangles.cols(); ++t) {
      Eigen::Matrix<double, 2, 3> places;
      for (int k = 0; k < 3; ++k) places.col(k) = map.col(surface.triangles(k, t));
      triangles.push_back(t);
      volumes.emplace_back(places.rowwise().minCoeff().array() - kSquareRounding,
                           places.rowwise().maxCoeff().array() + kSquareRounding);
    }
    boxes.init(triangles.begin(), triangles.end(), volumes.begin(), volumes.end());
  }

  /// Weights of a triangle's corners, by which the map's point is their mean.
  [[nodiscard]] Eigen::Vector3d shares(const Eigen::Vector2d& at, int triangle) const {
    Eigen::Matrix3d system;
    for (int k = 0; k < 3; ++k) system.col(k) << map.col(surface.triangles(k, triangle)), 1;
    return system.inverse() * Eigen::Vector3d(at.x(), at.y(), 1);
  }

  const SurfaceMesh& surface;
  const Eigen::Matrix2Xd map;
  ImageBoxes boxes;
};

namespace {

/// Query of Eigen's search: the triangle that the point is deepest in, or least far out of, by the
/// least share of a corner.
template <class Shares>
struct Deepest {
  [[nodiscard]] bool intersectVolume(const ImageBoxes::Volume& box) const {
    return box.contains(at);
  }
  bool intersectObject(int candidate) {
    const Eigen::Vector3d found = shares_of(at, candidate);
    if (found.allFinite() && found.minCoeff() > least) {
      least = found.minCoeff();
      shares = found;
      triangle = candidate;
    }
    return least >= 0;
  }

  const Eigen::Vector2d& at;
  const Shares& shares_of;
  int triangle = -1;
  Eigen::Vector3d shares = Eigen::Vector3d::Zero();
  double least = -std::numeric_limits<double>::infinity();
};

}  // namespace

PatchLift::PatchLift(const SurfaceMesh& surface) : impl_(std::make_unique<const Impl>(surface)) {}
PatchLift::~PatchLift() = default;

Eigen::Vector3d PatchLift::operator()(const Eigen::Vector2d& at) const {
  const auto shares_of = [this](const Eigen::Vector2d& point, int triangle) {
    return impl_->shares(point, triangle);
  };
  Deepest<decltype(shares_of)> deepest{at, shares_of};
  Eigen::BVIntersect(impl_->boxes, deepest);
  if (deepest.triangle < 0) {  // beyond the square
    for (int t = 0; t < impl_->surface.triangles.cols(); ++t) deepest.intersectObject(t);
  }
  return corners(impl_->surface, deepest.triangle) * deepest.shares;
}

}  // namespace limber::rods
