#include "engine/scene/pose_rules.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace limber::scene {

double reach_of_poses(const Scene& scene) {
  const auto& nodes = scene.mesh.nodes;
  if (nodes.cols() == 0 || !nodes.allFinite()) return std::numeric_limits<double>::max();
  const double length = (nodes.rowwise().maxCoeff() - nodes.rowwise().minCoeff()).maxCoeff();
  return length > 0 ? kFarthestNode * length : std::numeric_limits<double>::max();
}

std::optional<Issue> pose_fault(const Eigen::Ref<const Eigen::VectorXd>& displacements,
                                double reach) {
  for (Eigen::Index i = 0; i < displacements.size(); ++i) {
    if (!std::isfinite(displacements[i])) {
      return Issue{Issue::Severity::kError, "",
                   fmt::format("has a value that is not finite: node {}", i / 3),
                   ErrorCode::kInvalidArgument};
    }
    if (std::abs(displacements[i]) > reach) {
      return Issue{Issue::Severity::kError, "",
                   fmt::format("node {} is more than {:g} body lengths from its rest position",
                               i / 3, kFarthestNode),
                   ErrorCode::kOutOfRange};
    }
  }
  return std::nullopt;
}

}  // namespace limber::scene
