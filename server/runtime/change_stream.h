#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "limber/v1/service.pb.h"
#include "server/wire/frame_source.h"

namespace limber::server {

/// The state of a session's topic `changes` at its subscribers, and the messages that bring them
/// from one result to the next (see FrameChanges of limber.v1). Frames count as unchanged if no
/// coordinate differs from the sent one by more than the spacing of single precision at the largest
/// one. Differences do not add up over results. For one thread at a time.
class ChangeStream {
 public:
  /// @param chunk_bytes  of frames in a message, at most
  explicit ChangeStream(std::uint64_t chunk_bytes) : chunk_bytes_(chunk_bytes) {}

  /// To a newer result: viewed frames first, then those that change most. All of its frames where
  /// nothing was sent before, or in another basis. Nothing of a result that was sent already.
  /// @param looked_at  spans that come first, newest first
  [[nodiscard]] std::vector<proto::Frames> advance(const FrameSource& result,
                                                   const std::vector<FrameRange>& looked_at = {});
  /// Some frames of a result that is not whole yet; they are brought again with it. Nothing where
  /// subscribers hold no motion of that basis.
  [[nodiscard]] std::vector<proto::Frames> show_early(const FrameSource& part);
  /// All frames, for subscribers that hold none.
  [[nodiscard]] std::vector<proto::Frames> begin(const FrameSource& result);
  /// Nobody holds anything any more.
  void forget();

 private:
  struct Changes;
  [[nodiscard]] Changes compare(const FrameSource& result) const;
  void keep(const FrameSource& result, const std::vector<FrameRange>& ranges);
  [[nodiscard]] std::vector<proto::Frames> encode(const FrameSource& result,
                                                  const std::vector<FrameRange>& ranges,
                                                  std::uint64_t base) const;

  std::uint64_t chunk_bytes_;
  std::uint64_t sequence_ = 0;  // of the result that subscribers hold; 0: none
  std::string basis_hash_;
  Eigen::MatrixXf sent_;           // coordinates of each frame as they were sent last
  std::vector<FrameRange> early_;  // sent since, of no result
};

}  // namespace limber::server
