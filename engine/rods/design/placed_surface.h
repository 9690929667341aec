#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "engine/rods/design/target_surface.h"

namespace limber::rods {

/// Placement of a surface: x of the surface comes to translation + scale rotation x.
struct SurfacePlacement {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // is normalised
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();         // [length]
  double scale = 1;                                              // in [1e-12, 1e12]

  /// @throws Error{kInvalidArgument} naming the member
  void validate() const;
};

/// The placement moved on as a whole, turned and shifted, so that points of the placed surface come
/// as near to others as they can (least squares; Kabsch 1976).
/// @param points  3 x n, on the surface as it is placed now
/// @param target  3 x n, where they are to be
[[nodiscard]] SurfacePlacement fitted(const SurfacePlacement& placement,
                                      const Eigen::Matrix3Xd& points,
                                      const Eigen::Matrix3Xd& target);

/// A surface moved and scaled, without building it anew.
class PlacedSurface final : public TargetSurface {
 public:
  /// @throws Error as SurfacePlacement::validate
  PlacedSurface(std::shared_ptr<const TargetSurface> surface, const SurfacePlacement& placement);

  [[nodiscard]] ClosestPoint closest(const Eigen::Vector3d& point) const override;
  [[nodiscard]] double area() const override { return scale_ * scale_ * surface_->area(); }

 private:
  std::shared_ptr<const TargetSurface> surface_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d translation_;
  double scale_;
};

}  // namespace limber::rods
