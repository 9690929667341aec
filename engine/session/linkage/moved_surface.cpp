#include "engine/session/linkage/moved_surface.h"

#include <utility>

namespace limber::session {
namespace {

class MovedSurface final : public rods::TargetSurface {
 public:
  MovedSurface(std::shared_ptr<const rods::TargetSurface> surface, Eigen::Vector3d offset)
      : surface_(std::move(surface)), offset_(std::move(offset)) {}

  [[nodiscard]] rods::ClosestPoint closest(const Eigen::Vector3d& point) const override {
    rods::ClosestPoint found = surface_->closest(point - offset_);
    found.position += offset_;
    return found;
  }

 private:
  std::shared_ptr<const rods::TargetSurface> surface_;
  Eigen::Vector3d offset_;
};

}  // namespace

std::shared_ptr<const rods::TargetSurface> moved_surface(
    std::shared_ptr<const rods::TargetSurface> surface, const Eigen::Vector3d& offset) {
  if (!surface || offset.isZero(0)) return surface;
  return std::make_shared<MovedSurface>(std::move(surface), offset);
}

}  // namespace limber::session
