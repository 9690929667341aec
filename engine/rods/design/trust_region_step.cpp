#include "engine/rods/design/trust_region_step.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace limber::rods::detail {

ModelStep trust_region_step(const Eigen::VectorXd& slope, const TrustRegion& region,
                            const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& product,
                            CurvatureMemory& memory) {
  ModelStep step{Eigen::VectorXd::Zero(slope.size()), Eigen::VectorXd::Zero(slope.size())};
  const auto freed = [&](Eigen::VectorXd v) {
    for (Eigen::Index s = 0; s < slope.size(); ++s)
      if (slope[s] == 0) v[s] = 0;
    return v;
  };
  Eigen::VectorXd residual = -slope, scaled = freed(memory.inverse_times(residual));
  Eigen::VectorXd direction = scaled;
  double along = residual.dot(scaled);
  // By the memory's matrix M: p^T M p, p^T M d, d^T M d with the direction d (Conn, Gould and
  // Toint, sec. 7.5.1).
  double steps = 0, across = 0, direction_squared = along;
  const double rim = region.radius * region.radius;
  std::vector<std::pair<Eigen::VectorXd, Eigen::VectorXd>> products;
  for (int k = 0; k < region.max_products && residual.norm() > region.residual; ++k) {
    Eigen::VectorXd curved = freed(product(direction));
    const double curvature = direction.dot(curved);
    double length = curvature > 0 ? along / curvature : 0;
    const double reached = steps + length * (2 * across + length * direction_squared);
    step.at_rim = curvature <= 0 || reached >= rim;
    if (step.at_rim)
      length = (-across +
                std::sqrt(std::max(0.0, across * across - direction_squared * (steps - rim)))) /
               direction_squared;
    step.p += length * direction;
    step.bent += length * curved;
    residual -= length * curved;
    products.emplace_back(direction, std::move(curved));
    if (step.at_rim) break;
    scaled = freed(memory.inverse_times(residual));
    const double next = residual.dot(scaled), ratio = next / along;
    steps = reached;
    across = ratio * (across + length * direction_squared);
    direction_squared = next + ratio * ratio * direction_squared;
    along = next;
    direction = scaled + ratio * direction;
  }
  step.complete = !step.at_rim && residual.norm() <= region.residual;
  // Not before: the measure has to stay the same within a step.
  for (const auto& [v, curved] : products) memory.note(v, curved);
  return step;
}

}  // namespace limber::rods::detail
