#pragma once

#include "engine/rods/linkage/linkage_graph.h"

namespace limber::rods {

/// The longest side of the bounding box of a linkage as drawn [length].
[[nodiscard]] inline double drawn_extent(const LinkageGraph& graph) {
  Eigen::Vector3d low = graph.segments[0].points[0], high = low;
  for (const Segment& segment : graph.segments) {
    for (const Eigen::Vector3d& point : segment.points) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
  }
  return (high - low).maxCoeff();
}

}  // namespace limber::rods
