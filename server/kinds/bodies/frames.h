#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "engine/session/bodies/session.h"
#include "server/kinds/bodies/carried_surface.h"
#include "server/kinds/bodies/geometry.h"
#include "server/wire/frame_source.h"

namespace limber::server {

/// A request's range against a result. @throws Refusal as frame_range() of a number of frames
[[nodiscard]] FrameRange frame_range(std::uint32_t first, std::uint32_t count,
                                     const session::BodyResult& result);

/// Bytes of `count` frames in an encoding, without the envelope.
[[nodiscard]] std::uint64_t frames_bytes(proto::Encoding encoding, int count,
                                         const session::BodyResult& result,
                                         const session::Geometry& geometry,
                                         const CarriedSurface* surface = nullptr);

/// Frames of a result. ENCODING_UNSPECIFIED is COORDINATES.
///
/// COORDINATES copies q. POSITIONS is rest + B q: [nodes x 3] per frame [length unit], in single
/// precision but far from the origin (scene::precision_for()). POSITIONS_QUANTISED rounds those to
/// 65536 levels of the box around the range's own frames. For early frames, the range counts from
/// the first of them. SURFACE is of the vertices of the surface. @pre it is not null
[[nodiscard]] proto::Frames encode_frames(const session::BodyResult& result,
                                          const session::Geometry& geometry,
                                          proto::Encoding encoding, FrameRange range,
                                          double length_unit,
                                          const CarriedSurface* surface = nullptr);

/// Those of a body.
class BodyFrames final : public FrameSource {
 public:
  BodyFrames(std::shared_ptr<const session::BodyResult> result,
             std::shared_ptr<const session::Geometry> geometry, double length_unit,
             std::shared_ptr<const CarriedSurface> surface)
      : result_(std::move(result)),
        geometry_(std::move(geometry)),
        length_unit_(length_unit),
        surface_(std::move(surface)) {}

  [[nodiscard]] std::uint64_t sequence() const override { return result_->sequence; }
  [[nodiscard]] int frame_count() const override {
    return static_cast<int>(result_->coordinates.cols());
  }
  [[nodiscard]] const Eigen::MatrixXf* coordinates() const override {
    return &result_->coordinates;
  }
  [[nodiscard]] std::uint64_t revision() const override { return result_->revision; }
  [[nodiscard]] bool is_final() const override { return result_->is_final; }
  [[nodiscard]] std::uint64_t kept_bytes() const override;
  [[nodiscard]] std::uint64_t basis_bytes() const override;
  [[nodiscard]] std::string basis_hash() const override { return geometry_->basis_hash; }
  [[nodiscard]] std::optional<proto::GetGeometryResponse> geometry(
      const std::string& known_basis_hash) const override {
    return encode_geometry(*geometry_, known_basis_hash);
  }
  [[nodiscard]] bool has_surface() const override { return surface_ != nullptr; }
  [[nodiscard]] std::uint64_t bytes(proto::Encoding encoding, int count) const override {
    return frames_bytes(encoding, count, *result_, *geometry_, surface_.get());
  }
  [[nodiscard]] proto::Frames encode(proto::Encoding encoding, FrameRange range) const override {
    return encode_frames(*result_, *geometry_, encoding, range, length_unit_, surface_.get());
  }

 private:
  std::shared_ptr<const session::BodyResult> result_;
  std::shared_ptr<const session::Geometry> geometry_;
  double length_unit_;
  std::shared_ptr<const CarriedSurface> surface_;  // null: none
};

}  // namespace limber::server
