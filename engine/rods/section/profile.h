#pragma once

#include <Eigen/Core>
#include <vector>

namespace limber::rods {

/// A closed polygon, without repeating the first vertex at the end. Either sense of rotation.
using Polygon = std::vector<Eigen::Vector2d>;

/// A section by its outline, and the outlines of its holes.
struct Profile {
  Polygon outline;
  std::vector<Polygon> holes;

  /// @throws Error{kInvalidArgument} naming the polygon, and the vertex or edge. Polygons have
  /// three vertices at least, finite numbers and edges of some length. Edges do not cross or touch
  /// (of one polygon or of two); holes are inside the outline and not inside each other
  void validate() const;
  /// The same with the outline counter-clockwise and holes clockwise: the section is to the left.
  [[nodiscard]] Profile oriented() const;
};

/// Signed area: positive for counter-clockwise polygons.
[[nodiscard]] double signed_area(const Polygon& polygon);

/// Exact integrals over the section.
struct AreaMoments {
  double area = 0;
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  /// Integral of p p^T about the centroid [length^4].
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
};
/// @pre the profile is valid
[[nodiscard]] AreaMoments area_moments(const Profile& profile);

}  // namespace limber::rods
