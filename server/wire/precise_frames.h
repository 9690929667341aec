#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "engine/scene/formats/precision.h"
#include "server/wire/frames.h"

namespace limber::server {

/// Positions in POSITIONS, SURFACE or POSITIONS_QUANTISED as set_positions() of frames.h, as
/// float32 or float64. The box of quantised ones is that of the positions in double precision.
/// @param positions  3 nodes x frames [length unit]
void set_positions(const Eigen::MatrixXd& positions, scene::Precision precision,
                   proto::Encoding encoding, proto::Frames& frames);
/// Columns of coordinates as float32 or float64.
void set_coordinates(const Eigen::MatrixXd& coordinates, scene::Precision precision,
                     proto::Frames& frames);
/// 3 x rows to rows x 3, as float32 or float64.
[[nodiscard]] proto::Array encode_points(const Eigen::Ref<const Eigen::Matrix3Xd>& points,
                                         scene::Precision precision);
/// Bytes of a number in such an array.
[[nodiscard]] constexpr std::uint64_t bytes_of(scene::Precision precision) {
  return precision == scene::Precision::kFloat64 ? sizeof(double) : sizeof(float);
}

}  // namespace limber::server
