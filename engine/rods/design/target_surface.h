#pragma once

#include <Eigen/Core>
#include <limits>

namespace limber::rods {

/// The point of a surface that is closest to one in space.
struct ClosestPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  /// By the point in space, symmetric: I - n n^T inside a triangle, e e^T on an edge, 0 at a vertex
  /// (rod linkages, sec. 3).
  Eigen::Matrix3d derivative = Eigen::Matrix3d::Zero();
};

/// Target surface of a deployed linkage.
class TargetSurface {
 public:
  TargetSurface() = default;
  TargetSurface(const TargetSurface&) = delete;
  TargetSurface& operator=(const TargetSurface&) = delete;
  virtual ~TargetSurface() = default;

  [[nodiscard]] virtual ClosestPoint closest(const Eigen::Vector3d& point) const = 0;
  /// Total area [length^2]; infinite for surfaces without end.
  [[nodiscard]] virtual double area() const { return std::numeric_limits<double>::infinity(); }
};

}  // namespace limber::rods
