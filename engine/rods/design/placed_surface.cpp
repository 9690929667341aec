#include "engine/rods/design/placed_surface.h"

#include <fmt/format.h>

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
  if (!(scale > 0) || !std::isfinite(scale))
    refuse("scale", fmt::format("must be > 0 and finite, is {:g}", scale));
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
