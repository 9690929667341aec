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
  Eigen::VectorXd way = scaled;
  double along = residual.dot(scaled);
  // By the memory's matrix M: p^T M p, p^T M way, way^T M way (Conn, Gould and Toint, sec. 7.5.1).
  double steps = 0, across = 0, ways = along;
  const double rim = region.radius * region.radius;
  std::vector<std::pair<Eigen::VectorXd, Eigen::VectorXd>> seen;
  for (int k = 0; k < region.max_products && residual.norm() > region.residual; ++k) {
    Eigen::VectorXd curved = freed(product(way));
    const double curvature = way.dot(curved);
    double length = curvature > 0 ? along / curvature : 0;
    const double reached = steps + length * (2 * across + length * ways);
    step.at_rim = curvature <= 0 || reached >= rim;
    if (step.at_rim)
      length = (-across + std::sqrt(std::max(0.0, across * across - ways * (steps - rim)))) / ways;
    step.p += length * way;
    step.bent += length * curved;
    residual -= length * curved;
    seen.emplace_back(way, std::move(curved));
    if (step.at_rim) break;
    scaled = freed(memory.inverse_times(residual));
    const double next = residual.dot(scaled), kept = next / along;
    steps = reached;
    across = kept * (across + length * ways);
    ways = next + kept * kept * ways;
    along = next;
    way = scaled + kept * way;
  }
  step.complete = !step.at_rim && residual.norm() <= region.residual;
  // Not before: the measure has to stay the same within a step.
  for (const auto& [v, curved] : seen) memory.note(v, curved);
  return step;
}

}  // namespace limber::rods::detail
