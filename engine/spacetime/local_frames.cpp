#include "engine/spacetime/local_frames.h"

#include <algorithm>

#include "engine/spacetime/run_elimination.h"

namespace limber::spacetime {

std::vector<bool> local_frames(const ConstraintSet& constraints, const Timeline& timeline) {
  const int frames = timeline.frame_count;
  const FreeFrames free(timeline);
  std::vector<bool> local;
  for (const auto& [id, constraint] : constraints.positions) {
    if (!constraint.reach) continue;
    local.resize(static_cast<std::size_t>(frames), false);
    const int reach = std::min(*constraint.reach, frames);
    int begin = constraint.since.value_or(constraint.frame), end = constraint.frame;
    if (begin > end) end += frames;  // over the seam of a cycle
    for (int frame = begin - reach; frame <= end + reach; ++frame) {
      if (timeline.is_cyclic()) {
        local[static_cast<std::size_t>(free.within(frame))] = true;
      } else if (frame >= 0 && frame < frames) {
        local[static_cast<std::size_t>(frame)] = true;
      }
    }
  }
  return local;
}

std::vector<int> border_frames(const std::vector<bool>& local, const Timeline& timeline,
                               int width) {
  const FreeFrames free(timeline);
  const auto count = static_cast<int>(local.size());
  const auto is_local = [&](int frame) {
    frame = free.within(frame);
    return frame >= 0 && frame < count && local[static_cast<std::size_t>(frame)];
  };
  std::vector<int> border;
  for (int frame = free.first(); frame <= free.last() && frame < count; ++frame) {
    if (is_local(frame)) continue;
    bool is_near = false;
    for (int apart = 1; apart <= width; ++apart)
      is_near = is_near || is_local(frame - apart) || is_local(frame + apart);
    if (is_near) border.push_back(frame);
  }
  return border;
}

}  // namespace limber::spacetime
