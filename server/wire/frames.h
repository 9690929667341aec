#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

struct FrameRange {
  int first = 0;
  int count = 0;
};

/// A request's range against a motion of so many frames. @throws Refusal OUT_OF_RANGE naming
/// first_frame or frame_count
[[nodiscard]] FrameRange frame_range(std::uint32_t first, std::uint32_t count, int frame_count);

/// Frames without their data: the result they are of, encoding (UNSPECIFIED is COORDINATES), range.
[[nodiscard]] proto::Frames frames_of(proto::ResultInfo result, proto::Encoding encoding,
                                      FrameRange range);
[[nodiscard]] bool is_of_positions(proto::Encoding encoding);

/// Positions in POSITIONS or POSITIONS_QUANTISED, which rounds them to 65536 levels of their box.
/// @param positions  3 nodes x frames [length unit]
void set_positions(const Eigen::Ref<const Eigen::MatrixXf>& positions, proto::Encoding encoding,
                   proto::Frames& frames);
/// Columns of coordinates as they are.
void set_coordinates(const Eigen::Ref<const Eigen::MatrixXf>& coordinates, proto::Frames& frames);

}  // namespace limber::server
