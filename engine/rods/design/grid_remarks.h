#pragma once

#include <Eigen/Core>
#include <string>

#include "engine/rods/design/grid_curvature.h"

namespace limber::rods {

/// Root mean square difference in height between joints and points, over the plane nearest to the
/// points [length]. They are superimposed as well as they can, the joints mirrored or not, since a
/// grid does not determine the side to which it opens.
[[nodiscard]] double distance_between(const Eigen::Matrix3Xd& joints,
                                      const Eigen::Matrix3Xd& points);

/// Says so where an opened grid stays far from its surface, and why that may be.
/// @param distance, height  of the opened grid from the surface, and of that over its plane, root
/// mean square [length]
/// @param curvature  of the surface
/// @param curved_height  part of the height that its mean curvature makes up for
[[nodiscard]] std::string describe_distance(double distance, double height, double curved_height,
                                            const GridCurvature& curvature);

/// Says that a surface is not much higher than rods are thick: near where these begin to leave
/// their plane, lengths tell little of how far.
/// @param height  root mean square [length]
[[nodiscard]] std::string describe_thickness(double height, double thick);

/// Says so where rods fan out by less than the patch's sides ask for.
/// @param share  of that
[[nodiscard]] std::string describe_fan(double share);

}  // namespace limber::rods
