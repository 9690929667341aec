#include "server/kinds/bodies/frames.h"

#include "server/kinds/bodies/result.h"
#include "server/wire/precise_frames.h"

namespace limber::server {
namespace {

/// B q, the displacements, 3 nodes x frames.
Eigen::MatrixXf displacements_of(const session::BodyResult& result,
                                 const session::Geometry& geometry, FrameRange range) {
  Eigen::MatrixXf moved(geometry.basis.rows(), range.count);
  moved.noalias() = geometry.basis * result.coordinates.middleCols(range.first, range.count);
  return moved;
}

Eigen::Map<const Eigen::VectorXd> rest_of(const session::Geometry& geometry) {
  return {geometry.rest.data(), geometry.rest.size()};
}

/// rest + B q, column by column: 3 nodes x frames in single precision. Only the displacement is
/// rounded before the sum, so the error is relative to the motion and, once added, half a unit in
/// the last place of the position.
Eigen::MatrixXf positions_of(const session::BodyResult& result, const session::Geometry& geometry,
                             FrameRange range) {
  Eigen::MatrixXf positions = displacements_of(result, geometry, range);
  positions.colwise() += rest_of(geometry).cast<float>();
  return positions;
}

/// The same, where the body is far from the origin.
Eigen::MatrixXd far_positions_of(const session::BodyResult& result,
                                 const session::Geometry& geometry, FrameRange range) {
  return displacements_of(result, geometry, range).cast<double>().colwise() + rest_of(geometry);
}

}  // namespace

FrameRange frame_range(std::uint32_t first, std::uint32_t count,
                       const session::BodyResult& result) {
  return frame_range(first, count, static_cast<int>(result.coordinates.cols()));
}

std::uint64_t frames_bytes(proto::Encoding encoding, int count, const session::BodyResult& result,
                           const session::Geometry& geometry, const CarriedSurface* surface) {
  const auto frames = static_cast<std::uint64_t>(count);
  const auto values = static_cast<std::uint64_t>(geometry.basis.rows());
  const auto bytes = [&] { return bytes_of(scene::precision_for(geometry.rest)); };
  if (encoding == proto::ENCODING_SURFACE && surface != nullptr)
    return frames * static_cast<std::uint64_t>(surface->vertex_count()) * 3 * bytes();
  if (encoding == proto::ENCODING_POSITIONS) return frames * values * bytes();
  if (encoding == proto::ENCODING_POSITIONS_QUANTISED)
    return frames * values * sizeof(std::uint16_t);
  return frames * static_cast<std::uint64_t>(result.coordinates.rows()) * sizeof(float);
}

proto::Frames encode_frames(const session::BodyResult& result, const session::Geometry& geometry,
                            proto::Encoding encoding, FrameRange range, double length_unit,
                            const CarriedSurface* surface) {
  proto::Frames frames = frames_of(encode_result(result, length_unit), encoding,
                                   {result.first_frame + range.first, range.count});
  frames.set_basis_hash(geometry.basis_hash);
  const bool is_of_surface = encoding == proto::ENCODING_SURFACE && surface != nullptr;
  if (is_of_surface || is_of_positions(encoding)) {
    const scene::Precision precision = scene::precision_for(geometry.rest);
    if (is_of_surface) {
      set_positions(
          scene::embedded_positions(surface->embedding, far_positions_of(result, geometry, range)),
          precision, encoding, frames);
    } else if (precision == scene::Precision::kFloat64) {
      set_positions(far_positions_of(result, geometry, range), precision, encoding, frames);
    } else {
      set_positions(positions_of(result, geometry, range), encoding, frames);
    }
  } else {
    set_coordinates(result.coordinates.middleCols(range.first, range.count), frames);
  }
  return frames;
}

std::uint64_t BodyFrames::kept_bytes() const {
  return sizeof(session::BodyResult) +
         static_cast<std::uint64_t>(result_->coordinates.size()) * sizeof(float) +
         static_cast<std::uint64_t>(result_->modal.size()) * sizeof(double);
}

std::uint64_t BodyFrames::basis_bytes() const {
  // In single precision here, in double precision with the result.
  std::uint64_t bytes = static_cast<std::uint64_t>(geometry_->basis.size()) * sizeof(float);
  if (result_->shown && result_->shown->basis)
    bytes += static_cast<std::uint64_t>(result_->shown->basis->size()) * sizeof(double);
  return bytes;
}

}  // namespace limber::server
