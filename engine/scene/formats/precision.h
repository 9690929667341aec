#pragma once

#include <Eigen/Core>

namespace limber::scene {

enum class Precision { kFloat32, kFloat64 };

/// Number type for writing positions near these points. Single precision rounds a coordinate x by
/// up to 6e-8 |x|. If that could exceed half a millionth of the points' size, double is needed.
/// @param points  3 x count; without points, kFloat32
[[nodiscard]] Precision precision_for(const Eigen::Ref<const Eigen::Matrix3Xd>& points);

/// The middle of the points' box if they need double precision, else zero: formats of single
/// precision hold positions relative to it.
[[nodiscard]] Eigen::Vector3d origin_for(const Eigen::Ref<const Eigen::Matrix3Xd>& points);

}  // namespace limber::scene
