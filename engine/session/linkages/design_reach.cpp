#include "engine/session/linkages/design_reach.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "engine/base/error.h"

namespace limber::session {
namespace {

constexpr double kMaxDistanceExtents = 10;  // of the linkage's extent

}  // namespace

void demand_near(const DesignGoal& goal, const Eigen::Matrix3Xd& joints) {
  const double extent = (joints.rowwise().maxCoeff() - joints.rowwise().minCoeff()).norm();
  for (std::size_t i = 0; i < goal.targets.size(); ++i) {
    const rods::JointTarget& target = goal.targets[i];
    const double distance = (target.position - joints.col(target.joint)).norm();
    if (distance <= kMaxDistanceExtents * extent) continue;
    throw Error(ErrorCode::kOutOfRange, fmt::format("targets[{}].position", i),
                fmt::format("is {:g} from joint {}, and the linkage is {:g} large", distance,
                            target.joint, extent));
  }
  if (!goal.surface) return;
  const auto surface = goal.placed_surface();
  double nearest = std::numeric_limits<double>::infinity();
  for (Eigen::Index j = 0; j < joints.cols(); ++j) {
    nearest = std::min(nearest, (surface->closest(joints.col(j)).position - joints.col(j)).norm());
  }
  if (nearest <= kMaxDistanceExtents * extent) return;
  throw Error(ErrorCode::kOutOfRange, "surface",
              fmt::format("is {:g} from the nearest joint, and the linkage is {:g} large: is it "
                          "in the linkage's length unit and place?",
                          nearest, extent));
}

}  // namespace limber::session
