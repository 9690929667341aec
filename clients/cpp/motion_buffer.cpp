#include "clients/cpp/motion_buffer.h"

#include <algorithm>

#include "clients/cpp/array_numbers.h"
#include "clients/cpp/error.h"

namespace limber::client {

void MotionBuffer::begin(const v1::Frames& whole) {
  resize(whole, whole.frame_count());
  write(whole);
  sequence_ = whole.result().sequence();
  begun_ = 0;
}

MotionBuffer::Outcome MotionBuffer::put(const v1::Frames& frames) {
  const v1::FrameChanges& changes = frames.changes();
  const std::uint64_t sequence = frames.result().sequence();
  const bool is_next = sequence_ != 0 && changes.base_sequence() == sequence_;
  if (changes.early()) {
    if (!is_next || begun_ != 0) return Outcome::kIgnored;
    write(frames);
    return Outcome::kPart;
  }
  if (sequence <= sequence_) return Outcome::kIgnored;
  if (changes.part() != (sequence == begun_ ? parts_ : 0)) return Outcome::kLost;
  if (changes.part() == 0 && !is_next) {
    if (changes.base_sequence() != 0) return Outcome::kLost;
    resize(frames, changes.motion_frames());
    sequence_ = 0;
  }
  write(frames);
  parts_ = changes.part() + 1;
  if (changes.more()) {
    begun_ = sequence;
    return Outcome::kPart;
  }
  begun_ = 0;
  sequence_ = sequence;
  return Outcome::kWhole;
}

void MotionBuffer::resize(const v1::Frames& frames, std::size_t frame_count) {
  const auto& shape = frames.data().shape();
  std::size_t size = 1;
  for (int i = 1; i < shape.size(); ++i) size *= shape[i];
  // More than a server would hold: the message lies.
  constexpr std::size_t kMostNumbers = std::size_t{1} << 31;
  if (shape.empty() || size == 0 || frame_count > kMostNumbers / size)
    throw ClientError(v1::ERROR_CODE_MALFORMED, "", "frames without a shape that fits a motion");
  frame_count_ = frame_count;
  size_ = size;
  coordinates_.assign(frame_count * size, 0);
  basis_hash_ = frames.basis_hash();
}

void MotionBuffer::write(const v1::Frames& frames) {
  if (frames.frame_count() == 0) return;
  const auto values = real_numbers(frames.data(), frames.data().shape_size(), "frames");
  const std::size_t first = frames.first_frame(), count = frames.frame_count();
  if (count > frame_count_ || first > frame_count_ - count || values.size() != count * size_)
    throw ClientError(v1::ERROR_CODE_MALFORMED, "", "frames that do not fit the motion");
  std::copy(values.begin(), values.end(),
            coordinates_.begin() + static_cast<std::ptrdiff_t>(first * size_));
}

}  // namespace limber::client
