#include "engine/rods/design/grid_remarks.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "engine/rods/design/placed_surface.h"
#include "engine/rods/design/principal_axes.h"

namespace limber::rods {

double distance_between(const Eigen::Matrix3Xd& joints, const Eigen::Matrix3Xd& points) {
  const Eigen::Vector3d normal = principal_axes(points).col(0);
  const auto apart = [&](const Eigen::Matrix3Xd& one) {
    const SurfacePlacement fit = fitted({}, one, points);
    const Eigen::Matrix3Xd moved =
        (fit.rotation.toRotationMatrix() * one).colwise() + fit.translation;
    return std::sqrt((normal.transpose() * (moved - points)).squaredNorm() /
                     static_cast<double>(points.cols()));
  };
  Eigen::Matrix3Xd mirrored = joints;
  mirrored.row(2) *= -1;
  return std::min(apart(joints), apart(mirrored));
}

std::string describe_distance(double distance, double height, double curved_height,
                              const GridCurvature& curvature) {
  constexpr double kMaxDistanceShare = 0.6;  // of the height
  constexpr double kSmall = 0.5;  // twist, and share of the height, that decide on the reason
  if (distance <= kMaxDistanceShare * height) return "";
  const char* why = "";
  if (curvature.twist > kSmall) {
    why =
        ": it is twisted along the rods, where these rather bend; rods at 45 degrees to those "
        "lines would suit it";
  } else if (curved_height < kSmall * height) {
    why =
        ": it curves in one direction only, or to both sides by turns, which rods do not by "
        "themselves";
  }
  return fmt::format(
      "opened, the grid comes to about {:.2g} beside a surface that is {:.2g} high, both "
      "root mean square{}",
      distance, height, why);
}

std::string describe_thickness(double height, double thick) {
  return fmt::format(
      "the surface is {:.2g} high (root mean square), and rods are {:.2g} thick: "
      "thinner ones follow it better",
      height, thick);
}

std::string describe_fan(double share) {
  constexpr double kMaxShare = 0.9;  // of the requested fan: a larger share is not reported
  if (share > kMaxShare) return "";
  return fmt::format(
      "rods fan out by {:.0f} % of what the patch's sides ask for: a larger "
      "flat_angle leaves them more room",
      100 * share);
}

}  // namespace limber::rods
