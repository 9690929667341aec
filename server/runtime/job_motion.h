#pragma once

#include <cstdint>
#include <string>

#include "limber/v1/service.pb.h"
#include "server/wire/frames.h"

namespace limber::server {

/// A motion that a job made: its frames as positions, and its files. Immutable, shared between
/// threads.
class JobMotion {
 public:
  JobMotion() = default;
  virtual ~JobMotion() = default;
  JobMotion(const JobMotion&) = delete;
  JobMotion& operator=(const JobMotion&) = delete;

  [[nodiscard]] virtual int frame_count() const = 0;
  /// Bytes of so many frames, without the envelope.
  [[nodiscard]] virtual std::uint64_t bytes(int count) const = 0;
  [[nodiscard]] virtual proto::Frames encode(FrameRange range) const = 0;
  /// @throws Refusal naming `format`; OUT_OF_RANGE naming `part`
  [[nodiscard]] virtual proto::ExportResponse export_part(
      const proto::ExportRequest& request) const = 0;
};

}  // namespace limber::server
