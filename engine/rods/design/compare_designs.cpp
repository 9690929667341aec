#include "engine/rods/design/compare_designs.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace limber::rods {
namespace {

double distance(const LinkageState& a, const LinkageState& b) {
  LIMBER_DEMAND(a.joints().size() == b.joints().size());
  double sum = 0;
  for (std::size_t j = 0; j < a.joints().size(); ++j)
    sum += (a.joints()[j].position - b.joints()[j].position).squaredNorm();
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, a.joints().size())));
}

}  // namespace

DesignDifference compare_designs(const DesignPoint& a, const DesignPoint& b) {
  LIMBER_DEMAND(a.lengths.size() == b.lengths.size());
  return {(a.lengths - b.lengths).cwiseQuotient(a.lengths).cwiseAbs().maxCoeff(),
          distance(a.flat, b.flat), distance(a.deployed, b.deployed)};
}

}  // namespace limber::rods
