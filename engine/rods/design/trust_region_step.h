#pragma once

#include <Eigen/Core>
#include <functional>

#include "engine/rods/design/curvature_memory.h"

namespace limber::rods::detail {

/// A step with its values by the quadratic model.
struct ModelStep {
  Eigen::VectorXd p, bent;  // bent: H p
  bool at_rim = false;      // of the trust region
  bool complete = false;    // the model's least, to the requested residual
};

struct TrustRegion {
  double radius = 1;    // by the memory's measure
  double residual = 0;  // of slope + H p, at which the step is good enough
  int max_products = 60;
};

/// Conjugate gradients from nothing until the region's rim, negative curvature, or a small residual
/// (Steihaug 1983), preconditioned by the curvature memory. The region is measured by the same
/// matrix, so that a step may go far where the function hardly changes. The memory learns.
/// @param slope  g; components that are zero do not move
/// @param product  H v
[[nodiscard]] ModelStep trust_region_step(
    const Eigen::VectorXd& slope, const TrustRegion& region,
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& product, CurvatureMemory& memory);

}  // namespace limber::rods::detail
