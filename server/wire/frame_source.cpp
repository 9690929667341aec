#include "server/wire/frame_source.h"

#include <algorithm>

namespace limber::server {

int frames_within(std::uint64_t most_bytes, std::uint64_t frame_bytes, int count) {
  const std::uint64_t frames = most_bytes / std::max<std::uint64_t>(1, frame_bytes);
  return static_cast<int>(std::clamp<std::uint64_t>(frames, 1, static_cast<std::uint64_t>(count)));
}

std::vector<FrameRange> chunks_of(const FrameSource& source, proto::Encoding encoding,
                                  FrameRange range, std::uint64_t most_bytes) {
  const int step = frames_within(most_bytes, source.bytes(encoding, 1), std::max(1, range.count));
  const int end = range.first + range.count;
  std::vector<FrameRange> chunks;
  for (int first = range.first; first < end; first += std::min(step, end - first))
    chunks.push_back({first, std::min(step, end - first)});
  return chunks;
}

}  // namespace limber::server
