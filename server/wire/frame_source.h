#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "limber/v1/service.pb.h"
#include "server/wire/frames.h"

namespace limber::server {

class FrameSource;

/// How many of `count` frames of so many bytes each a message of at most `most_bytes` has: at least
/// one. @pre count > 0
[[nodiscard]] int frames_within(std::uint64_t most_bytes, std::uint64_t frame_bytes, int count);

/// A range in parts of at most so many bytes in this encoding, each of at least one frame.
[[nodiscard]] std::vector<FrameRange> chunks_of(const FrameSource& source, proto::Encoding encoding,
                                                FrameRange range, std::uint64_t most_bytes);

/// The frames of one published result of a session of any kind, to be encoded as they are
/// requested. Immutable, shared between threads.
class FrameSource {
 public:
  FrameSource() = default;
  virtual ~FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;

  /// Of the result.
  [[nodiscard]] virtual std::uint64_t sequence() const = 0;
  [[nodiscard]] virtual int frame_count() const = 0;
  /// Newest edit in the result, and whether it is the end of that revision's solve.
  [[nodiscard]] virtual std::uint64_t revision() const { return 0; }
  [[nodiscard]] virtual bool is_final() const { return true; }
  /// Memory that the result takes as long as this keeps it [bytes], without shared parts.
  [[nodiscard]] virtual std::uint64_t kept_bytes() const { return 0; }
  /// The same of the basis, which results share.
  [[nodiscard]] virtual std::uint64_t basis_bytes() const { return 0; }
  /// h x frames, where frames are multiples of a basis: null for kinds without one.
  [[nodiscard]] virtual const Eigen::MatrixXf* coordinates() const { return nullptr; }
  /// Of that basis.
  [[nodiscard]] virtual std::string basis_hash() const { return {}; }
  /// Geometry that turns its coordinates into positions; nothing if the kind never changes it.
  /// @param known_basis_hash  what a client has already, it is left out
  [[nodiscard]] virtual std::optional<proto::GetGeometryResponse> geometry(
      const std::string& /*known_basis_hash*/) const {
    return std::nullopt;
  }
  /// Whether ENCODING_SURFACE can be requested.
  [[nodiscard]] virtual bool has_surface() const { return false; }
  /// Bytes of so many frames, without the envelope.
  [[nodiscard]] virtual std::uint64_t bytes(proto::Encoding encoding, int count) const = 0;
  /// With the result that they are of. ENCODING_UNSPECIFIED is COORDINATES.
  [[nodiscard]] virtual proto::Frames encode(proto::Encoding encoding, FrameRange range) const = 0;
};

}  // namespace limber::server
