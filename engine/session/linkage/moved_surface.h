#pragma once

#include <Eigen/Core>
#include <memory>

#include "engine/rods/design/target_surface.h"

namespace limber::session {

/// A surface moved by an offset [length], without a copy of it; itself for none, null for null.
[[nodiscard]] std::shared_ptr<const rods::TargetSurface> moved_surface(
    std::shared_ptr<const rods::TargetSurface> surface, const Eigen::Vector3d& offset);

}  // namespace limber::session
