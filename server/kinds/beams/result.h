#pragma once

#include <memory>
#include <utility>

#include "engine/session/beams/session.h"
#include "server/wire/frame_source.h"
#include "server/wire/precise_frames.h"

namespace limber::server {

[[nodiscard]] proto::ResultInfo encode_beam_result(const session::BeamResult& result);
[[nodiscard]] proto::DiscretisationError encode_discretisation(
    const session::DiscretisationCheck& check);

[[nodiscard]] proto::GetGeometryResponse encode_beam_geometry(const beams::BeamModel& model);

/// Frames of a structure of beams: positions and rotations of its nodes, or positions alone.
class BeamFrames final : public FrameSource {
 public:
  explicit BeamFrames(std::shared_ptr<const session::BeamResult> result)
      : result_(std::move(result)) {}

  [[nodiscard]] std::uint64_t sequence() const override { return result_->sequence; }
  [[nodiscard]] int frame_count() const override {
    return static_cast<int>(result_->frames->cols());
  }
  [[nodiscard]] std::uint64_t revision() const override { return result_->revision; }
  [[nodiscard]] bool is_final() const override { return result_->is_final; }
  [[nodiscard]] std::uint64_t kept_bytes() const override {
    return sizeof(session::BeamResult) +
           static_cast<std::uint64_t>(result_->frames->size()) * sizeof(double);
  }
  [[nodiscard]] std::uint64_t bytes(proto::Encoding encoding, int count) const override;
  [[nodiscard]] proto::Frames encode(proto::Encoding encoding, FrameRange range) const override;

 private:
  [[nodiscard]] Eigen::Index nodes() const { return result_->frames->rows() / 7; }
  [[nodiscard]] scene::Precision precision() const;  // of positions

  std::shared_ptr<const session::BeamResult> result_;
};

}  // namespace limber::server
