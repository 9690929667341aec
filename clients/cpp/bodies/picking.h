#pragma once

#include <cstdint>
#include <vector>

#include "clients/cpp/open_session.h"
#include "limber/v1/service.pb.h"

namespace limber::client {

/// Triangles and where their vertices are, at rest or in a frame.
struct DrawnSurface {
  std::vector<double> vertices;         // n x 3 [length unit]
  std::vector<std::int32_t> triangles;  // t x 3
  v1::PointSurface surface = v1::POINT_SURFACE_UNSPECIFIED;
};

/// A point of a surface: the value for Constraint.point, and its position.
struct PickedPoint {
  v1::SurfacePoint point;
  Vector position{};    // [length unit]
  double distance = 0;  // of that from where it was looked for [length unit]
};

/// The point of a surface that is nearest to a position; of several that of the first triangle.
/// @throws ClientError FAILED_PRECONDITION for a surface without triangles
[[nodiscard]] PickedPoint nearest_point(const DrawnSurface& surface, const Vector& position);

/// The ids of those points (n x 3) in a box with sides along the axes, its faces included.
[[nodiscard]] std::vector<std::uint32_t> points_in_box(const std::vector<double>& points,
                                                       const Vector& low, const Vector& high);

}  // namespace limber::client
