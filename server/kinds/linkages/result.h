#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "engine/session/linkages/session.h"
#include "engine/session/linkages/shape.h"
#include "server/wire/frame_source.h"
#include "server/wire/precise_frames.h"

namespace limber::server {

/// @param length_unit  metres per scene unit: energies of the engine are in N times that unit, on
/// the wire in J
[[nodiscard]] proto::ResultInfo encode_linkage_result(const session::LinkageResult& result,
                                                      double length_unit);

/// The answer that a stored result states; empty if it cannot be returned to: not final, cancelled,
/// or of a design.
[[nodiscard]] std::optional<session::RecalledAnswer> decode_linkage_answer(
    const proto::ResultInfo& info);

/// @param known_basis_hash  where that is the hash, the client has all of it: it comes alone
[[nodiscard]] proto::GetGeometryResponse encode_linkage_geometry(
    const session::LinkageGeometry& geometry, const std::string& known_basis_hash);

/// Frames of a linkage: coordinates, or nodes of the swept surface.
class LinkageFrames final : public FrameSource {
 public:
  LinkageFrames(std::shared_ptr<const session::LinkageResult> result, double length_unit)
      : result_(std::move(result)), length_unit_(length_unit) {}

  [[nodiscard]] std::uint64_t sequence() const override { return result_->sequence; }
  [[nodiscard]] int frame_count() const override {
    return static_cast<int>(result_->frames->cols());
  }
  [[nodiscard]] std::uint64_t revision() const override { return result_->revision; }
  [[nodiscard]] bool is_final() const override { return result_->is_final; }
  [[nodiscard]] std::uint64_t kept_bytes() const override;
  [[nodiscard]] std::string basis_hash() const override { return result_->geometry->hash; }
  [[nodiscard]] std::optional<proto::GetGeometryResponse> geometry(
      const std::string& known_basis_hash) const override {
    return encode_linkage_geometry(*result_->geometry, known_basis_hash);
  }
  [[nodiscard]] std::uint64_t bytes(proto::Encoding encoding, int count) const override;
  [[nodiscard]] proto::Frames encode(proto::Encoding encoding, FrameRange range) const override;

 private:
  [[nodiscard]] scene::Precision precision() const;  // of positions

  std::shared_ptr<const session::LinkageResult> result_;
  double length_unit_;
};

}  // namespace limber::server
