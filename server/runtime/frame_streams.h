#pragma once

#include <array>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/runtime/change_stream.h"
#include "server/runtime/hub.h"
#include "server/wire/frame_source.h"

namespace limber::server {

/// The frame topics of one session. Coordinates and changes are sent when a result is published.
/// Positions have to be computed: another thread makes them from the newest result and skips
/// results that come meanwhile. Nothing is encoded for a topic without subscribers. Thread-safe.
class FrameStreams : public std::enable_shared_from_this<FrameStreams> {
 public:
  FrameStreams(Hub& hub, SessionKey session);

  void note(const std::shared_ptr<const FrameSource>& result);
  /// Some frames of the next result, see ChangeStream.
  void note_early(const std::vector<std::shared_ptr<const FrameSource>>& parts);
  /// Somebody would see early frames.
  [[nodiscard]] bool has_early_viewers() const;
  /// Changes in these frames are sent first. The newest 8 such spans count, each to 4,096 frames.
  void look_at(FrameRange frames);
  /// There is a new subscriber to `prefix`: the newest frames of matching topics are sent again, so
  /// that it need not wait for the next edit. Frames that it already has are left out, unless there
  /// is a newer result that was not published for lack of subscribers.
  void welcome(const std::string& prefix, Has has);
  void close();

 private:
  static constexpr std::size_t kTopics = 4;
  static constexpr std::size_t kChangesTopic = kTopics;  // in published_
  void note_published(std::size_t topic, std::uint64_t result);
  [[nodiscard]] StreamBytes message_of(proto::Frames frames) const;
  void publish(std::size_t topic, const FrameSource& result);
  void publish_changes(std::vector<proto::Frames> changes);
  [[nodiscard]] std::shared_ptr<const FrameSource> newest();
  [[nodiscard]] std::vector<FrameRange> looked_at();
  void request(unsigned topics);  // bits
  void encode_due();

  Hub& hub_;
  const SessionKey session_;
  std::array<std::string, kTopics> topics_;
  std::string changes_topic_;
  std::mutex coordinates_;  // one publication at a time, so that none overtakes a newer one
  std::mutex changing_;     // the same of changes
  ChangeStream changes_;    // under changing_
  std::mutex mutex_;        // of what follows
  std::shared_ptr<const FrameSource> newest_;
  std::array<std::uint64_t, kTopics + 1> published_{};  // results, by topic; 0: none
  std::deque<FrameRange> looked_at_;                    // newest first
  unsigned due_ = 0;  // topics to be made from newest_, by the encoder
  bool encoding_ = false, closed_ = false;
};

}  // namespace limber::server
