#include "engine/scene/formats/precision.h"

namespace limber::scene {
namespace {

/// Coordinates beyond so many times the size need double precision.
constexpr double kFarSizes = 8;

}  // namespace

Precision precision_for(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  if (points.cols() == 0) return Precision::kFloat32;
  const double size = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).maxCoeff();
  return points.cwiseAbs().maxCoeff() > kFarSizes * size ? Precision::kFloat64
                                                         : Precision::kFloat32;
}

Eigen::Vector3d origin_for(const Eigen::Ref<const Eigen::Matrix3Xd>& points) {
  if (precision_for(points) == Precision::kFloat32) return Eigen::Vector3d::Zero();
  return 0.5 * (points.rowwise().maxCoeff() + points.rowwise().minCoeff());
}

}  // namespace limber::scene
