#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "limber/v1/service.pb.h"

namespace limber::client {

/// The motion of a session, kept up to date by the messages of its topic `changes` (FrameChanges).
class MotionBuffer {
 public:
  enum class Outcome {
    kIgnored,  // older than the held motion
    kPart,     // some frames are new, others are still to come
    kWhole,    // the motion is that of the message's result
    kLost,     // messages are missing: begin() with the result of GetFrames
  };

  /// All frames of a result, of GetFrames. @throws ClientError MALFORMED
  void begin(const v1::Frames& whole);
  /// @throws ClientError MALFORMED
  Outcome put(const v1::Frames& frames);

  [[nodiscard]] std::size_t frame_count() const { return frame_count_; }
  /// Numbers of a frame.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// frames x size, row by row.
  [[nodiscard]] const std::vector<double>& coordinates() const { return coordinates_; }
  [[nodiscard]] const std::string& basis_hash() const { return basis_hash_; }
  /// ResultInfo.sequence of the result that the motion is of; 0: of none.
  [[nodiscard]] std::uint64_t sequence() const { return sequence_; }

 private:
  void resize(const v1::Frames& frames, std::size_t frame_count);
  void write(const v1::Frames& frames);

  std::size_t frame_count_ = 0, size_ = 0;
  std::vector<double> coordinates_;
  std::string basis_hash_;
  std::uint64_t sequence_ = 0;
  std::uint64_t begun_ = 0;  // of a result that some frames are of already; 0: none
  std::uint32_t parts_ = 0;  // of its messages that have come
};

}  // namespace limber::client
