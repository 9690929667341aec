#include "server/wire/frame_source.h"

#include <algorithm>

namespace limber::server {

std::vector<FrameRange> chunks_of(const FrameSource& source, proto::Encoding encoding,
                                  FrameRange range, std::uint64_t most_bytes) {
  const std::uint64_t per_frame = std::max<std::uint64_t>(1, source.bytes(encoding, 1));
  const int step = static_cast<int>(std::clamp<std::uint64_t>(most_bytes / per_frame, 1, 1u << 30));
  const int end = range.first + range.count;
  std::vector<FrameRange> chunks;
  for (int first = range.first; first < end; first += std::min(step, end - first))
    chunks.push_back({first, std::min(step, end - first)});
  return chunks;
}

}  // namespace limber::server
