#pragma once

#include "engine/session/bodies/session.h"
#include "limber/v1/service.pb.h"
#include "server/wire/errors.h"

namespace limber::server {

struct FrameRange {
  int first = 0;
  int count = 0;
};

/// A request's range against a result. @throws Refusal OUT_OF_RANGE naming first_frame or
/// frame_count
[[nodiscard]] FrameRange frame_range(std::uint32_t first, std::uint32_t count,
                                     const session::BodyResult& result);
/// The same of a motion of so many frames.
[[nodiscard]] FrameRange frame_range(std::uint32_t first, std::uint32_t count, int frame_count);

/// Bytes of `count` frames in an encoding, without the envelope.
[[nodiscard]] std::uint64_t frames_bytes(proto::Encoding encoding, int count,
                                         const session::BodyResult& result,
                                         const session::Geometry& geometry);

/// Positions in POSITIONS or POSITIONS_QUANTISED, which rounds them to 65536 levels of their box.
/// @param positions  3 nodes x frames [length unit]
void set_positions(const Eigen::MatrixXf& positions, proto::Encoding encoding,
                   proto::Frames& frames);
/// Columns of coordinates as they are.
void set_coordinates(const Eigen::Ref<const Eigen::MatrixXf>& coordinates, proto::Frames& frames);

/// Frames of a result. ENCODING_UNSPECIFIED is COORDINATES.
///
/// COORDINATES copies q. POSITIONS is rest + B q in single precision: [nodes x 3] per frame [length
/// unit]. POSITIONS_QUANTISED rounds those to 65536 levels of the box around the range's own
/// frames.
[[nodiscard]] proto::Frames encode_frames(const session::BodyResult& result,
                                          const session::Geometry& geometry,
                                          proto::Encoding encoding, FrameRange range,
                                          double length_unit);

}  // namespace limber::server
