#pragma once

#include <memory>
#include <utility>

#include "server/wire/frame_source.h"

namespace limber::server {

/// Those of a body.
class BodyFrames final : public FrameSource {
 public:
  BodyFrames(std::shared_ptr<const session::BodyResult> result,
             std::shared_ptr<const session::Geometry> geometry, double length_unit)
      : result_(std::move(result)), geometry_(std::move(geometry)), length_unit_(length_unit) {}

  [[nodiscard]] std::uint64_t sequence() const override { return result_->sequence; }
  [[nodiscard]] int frame_count() const override {
    return static_cast<int>(result_->coordinates.cols());
  }
  [[nodiscard]] std::uint64_t bytes(proto::Encoding encoding, int count) const override {
    return frames_bytes(encoding, count, *result_, *geometry_);
  }
  [[nodiscard]] proto::Frames encode(proto::Encoding encoding, FrameRange range) const override {
    return encode_frames(*result_, *geometry_, encoding, range, length_unit_);
  }

 private:
  std::shared_ptr<const session::BodyResult> result_;
  std::shared_ptr<const session::Geometry> geometry_;
  double length_unit_;
};

}  // namespace limber::server
