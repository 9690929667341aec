#include "engine/rods/design/compare_designs.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

double distance_of_joints(const LinkageState& a, const LinkageState& b) {
  LIMBER_DEMAND(a.joints().size() == b.joints().size());
  double sum = 0;
  for (std::size_t j = 0; j < a.joints().size(); ++j)
    sum += (a.joints()[j].position - b.joints()[j].position).squaredNorm();
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, a.joints().size())));
}

double relative(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  LIMBER_DEMAND(a.size() == b.size());
  return (a - b).cwiseQuotient(a).cwiseAbs().maxCoeff();
}

}  // namespace

DesignDifference compare_designs(const DesignPoint& a, const DesignPoint& b) {
  LIMBER_DEMAND(a.lengths.size() == b.lengths.size());
  double sizes = relative(a.lengths, b.lengths);
  if (a.edges.size() > 0 && b.edges.size() > 0) sizes = std::max(sizes, relative(a.edges, b.edges));
  const Eigen::VectorXd same = Eigen::VectorXd::Ones(a.lengths.size());
  const auto sections = [&](const DesignPoint& point) -> const Eigen::VectorXd& {
    return point.sections.size() > 0 ? point.sections : same;
  };
  return {std::max(sizes, relative(sections(a), sections(b))), distance_of_joints(a.flat, b.flat),
          distance_of_joints(a.deployed, b.deployed)};
}

}  // namespace limber::rods
