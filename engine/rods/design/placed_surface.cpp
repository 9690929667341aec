#include "engine/rods/design/placed_surface.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <utility>

#include "engine/base/error.h"

namespace limber::rods {

void SurfacePlacement::validate() const {
  const auto refuse = [](const char* field, const std::string& message) {
    throw Error(ErrorCode::kInvalidArgument, field, message);
  };
  if (!rotation.coeffs().allFinite() || !(rotation.norm() > 0))
    refuse("rotation", "must be finite and not zero");
  if (!translation.allFinite()) refuse("translation", "must be finite");
  // Beyond, squares of lengths and of their quotients leave the range of numbers.
  constexpr double kLeastScale = 1e-12, kMaxScale = 1e12;
  if (!(scale >= kLeastScale && scale <= kMaxScale))
    refuse("scale", fmt::format("must be in [{:g}, {:g}], is {:g}", kLeastScale, kMaxScale, scale));
}

SurfacePlacement fitted(const SurfacePlacement& placement, const Eigen::Matrix3Xd& points,
                        const Eigen::Matrix3Xd& target) {
  LIMBER_DEMAND(points.cols() == target.cols());
  const Eigen::Vector3d from = points.rowwise().mean(), to = target.rowwise().mean();
  const Eigen::Matrix3d spread = (target.colwise() - to) * (points.colwise() - from).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(spread, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handed = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d turn =
      svd.matrixU() * Eigen::Vector3d(1, 1, handed).asDiagonal() * svd.matrixV().transpose();
  SurfacePlacement result = placement;
  result.rotation = Eigen::Quaterniond(turn) * placement.rotation.normalized();
  result.translation = turn * (placement.translation - from) + to;
  return result;
}

PlacedSurface::PlacedSurface(std::shared_ptr<const TargetSurface> surface,
                             const SurfacePlacement& placement)
    : surface_(std::move(surface)) {
  placement.validate();
  rotation_ = placement.rotation.normalized().toRotationMatrix();
  translation_ = placement.translation;
  scale_ = placement.scale;
}

ClosestPoint PlacedSurface::closest(const Eigen::Vector3d& point) const {
  const ClosestPoint own =
      surface_->closest(rotation_.transpose() * (point - translation_) / scale_);
  return {translation_ + scale_ * (rotation_ * own.position),
          rotation_ * own.derivative * rotation_.transpose()};
}

}  // namespace limber::rods
