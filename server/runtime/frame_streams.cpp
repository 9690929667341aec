#include "server/runtime/frame_streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>

#include "server/log/log.h"
#include "server/runtime/stream_message.h"

namespace limber::server {
namespace {

/// A message of the stream holds at most so many bytes of frames; longer motions come in several.
constexpr std::uint64_t kChunkBytes = 64ull << 20;

constexpr std::array<proto::Encoding, 4> kEncodings{
    proto::ENCODING_COORDINATES, proto::ENCODING_POSITIONS, proto::ENCODING_POSITIONS_QUANTISED,
    proto::ENCODING_SURFACE};
// Spans that clients look at, and frames of each that come first.
constexpr std::size_t kLookedAt = 8;
constexpr int kMostLookedAt = 4096;
constexpr unsigned kCoordinates = 1, kEncoded = 15,
                   kChanges = 16;  // bits of topics, in their order

}  // namespace

FrameStreams::FrameStreams(Hub& hub, SessionKey session)
    : hub_(hub), session_(std::move(session)), changes_(kChunkBytes) {
  const std::string base = fmt::format("session/{}/body/0/", session_.name);
  topics_ = {base + "coordinates", base + "positions", base + "quantised", base + "surface"};
  changes_topic_ = base + "changes";
}

void FrameStreams::note(const std::shared_ptr<const FrameSource>& result) {
  {
    const std::lock_guard lock(mutex_);
    // Two threads tell of results while a session opens: the older one never replaces the newer.
    if (newest_ && newest_->sequence() > result->sequence()) return;
    newest_ = result;
  }
  if (hub_.transport.has_subscriber(topics_[0])) {
    const std::lock_guard order(coordinates_);
    publish(0, *result);
  }
  {
    const std::lock_guard order(changing_);
    if (hub_.transport.has_subscriber(changes_topic_)) {
      publish_changes(changes_.advance(*result, looked_at()));
      note_published(kChangesTopic, result->sequence());
    } else {
      changes_.forget();
      note_published(kChangesTopic, 0);
    }
  }
  request(kEncoded & ~kCoordinates);
}

void FrameStreams::note_early(const std::vector<std::shared_ptr<const FrameSource>>& parts) {
  const std::lock_guard order(changing_);
  std::vector<proto::Frames> early;
  for (const auto& part : parts) {
    for (proto::Frames& frames : changes_.show_early(*part)) early.push_back(std::move(frames));
  }
  publish_changes(std::move(early));
}

bool FrameStreams::has_early_viewers() const {
  return hub_.transport.has_subscriber(changes_topic_);
}

void FrameStreams::look_at(FrameRange frames) {
  frames.count = std::min(frames.count, kMostLookedAt);
  const std::lock_guard lock(mutex_);
  looked_at_.push_front(frames);
  if (looked_at_.size() > kLookedAt) looked_at_.pop_back();
}

void FrameStreams::note_published(std::size_t topic, std::uint64_t result) {
  const std::lock_guard lock(mutex_);
  published_.at(topic) = result;
}

void FrameStreams::welcome(const std::string& prefix, Has has) {
  unsigned topics = 0;
  for (std::size_t i = 0; i < kTopics; ++i) {
    if (topics_[i].compare(0, prefix.size(), prefix) == 0) topics |= 1u << i;
  }
  if (changes_topic_.compare(0, prefix.size(), prefix) == 0) topics |= kChanges;
  if (has == Has::kNewest) {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; newest_ && i <= kChangesTopic; ++i) {
      if (published_[i] == newest_->sequence()) topics &= ~(1u << i);
    }
  }
  request(topics);
}

void FrameStreams::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
}

void FrameStreams::request(unsigned topics) {
  for (std::size_t i = 0; i < kTopics; ++i) {
    if (!hub_.transport.has_subscriber(topics_[i])) topics &= ~(1u << i);
  }
  if (!hub_.transport.has_subscriber(changes_topic_)) topics &= ~kChanges;
  if (topics == 0) return;
  {
    const std::lock_guard lock(mutex_);
    if (closed_ || !newest_) return;
    due_ |= topics;
    if (std::exchange(encoding_, true)) return;
  }
  boost::asio::post(hub_.request_pool, [self = shared_from_this()] { self->encode_due(); });
}

void FrameStreams::encode_due() {
  while (true) {
    std::unique_lock<std::mutex> order;
    unsigned due = 0;
    {
      const std::lock_guard lock(mutex_);
      due = std::exchange(due_, 0);
      if (due == 0 || closed_ || hub_.stopping.load()) {
        encoding_ = false;
        return;
      }
    }
    try {
      for (std::size_t i = 0; i < kTopics; ++i) {
        if ((due >> i & 1u) == 0) continue;
        if (i == 0) order = std::unique_lock(coordinates_);
        publish(i, *newest());
        if (order) order.unlock();
      }
      if ((due & kChanges) != 0) {
        const std::lock_guard changing(changing_);
        const auto result = newest();
        publish_changes(changes_.begin(*result));
        note_published(kChangesTopic, result->sequence());
      }
    } catch (const std::exception& fault) {  // out of memory: this publication is lost
      log::error(log::Fields{{"session", session_.name}, {"error", fault.what()}},
                 "frames of {}: {}", session_.name, fault.what());
    }
  }
}

std::shared_ptr<const FrameSource> FrameStreams::newest() {
  const std::lock_guard lock(mutex_);
  return newest_;
}

std::vector<FrameRange> FrameStreams::looked_at() {
  const std::lock_guard lock(mutex_);
  return {looked_at_.begin(), looked_at_.end()};
}

StreamBytes FrameStreams::message_of(proto::Frames frames) const {
  auto message = stream_message(hub_.run, session_.name, session_.uid);
  message.mutable_frames()->Swap(&frames);
  // With room for the sequence number: a motion is not copied for it.
  StreamBytes bytes;
  bytes.reserve(message.ByteSizeLong() + kSequenceBytes);
  message.AppendToString(&bytes);
  return bytes;
}

/// Each message continues the one before it: none is replaced, unless by a whole motion.
void FrameStreams::publish_changes(std::vector<proto::Frames> changes) {
  if (changes.empty()) return;
  const bool begins = changes.front().changes().base_sequence() == 0;
  std::vector<StreamBytes> messages;
  messages.reserve(changes.size());
  for (proto::Frames& frames : changes) messages.push_back(message_of(std::move(frames)));
  hub_.transport.publish(changes_topic_, std::move(messages),
                         begins ? TopicSlots::Keep::kBegin : TopicSlots::Keep::kOrder);
}

void FrameStreams::publish(std::size_t topic, const FrameSource& result) {
  const proto::Encoding encoding = kEncodings[topic];
  if (encoding == proto::ENCODING_SURFACE && !result.has_surface()) return;
  std::vector<StreamBytes> messages;
  for (const FrameRange& chunk :
       chunks_of(result, encoding, {0, result.frame_count()}, kChunkBytes))
    messages.push_back(message_of(result.encode(encoding, chunk)));
  hub_.transport.publish(topics_[topic], std::move(messages));
  note_published(topic, result.sequence());  // not where it could not be encoded
}

}  // namespace limber::server
