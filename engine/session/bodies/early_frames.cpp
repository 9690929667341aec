#include "engine/session/bodies/early_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "engine/session/bodies/impl.h"
#include "engine/session/bodies/problem_mapping.h"

namespace limber::session {
namespace {

// Frames on either side of an edited one: ten swings of a mode of 50 frames.
constexpr int kAround = 256;
// Frames between constraints that are computed for early ones, at most: some milliseconds.
constexpr int kMostFilled = 65'536;

/// Disjoint spans, in order.
class Spans {
 public:
  explicit Spans(int left) : left_(left) {}

  /// Adds the missing frames of first .. end - 1, as long as there is room.
  void add(int first, int end) {
    for (int from = first; from < end && left_ > 0;) {
      const auto next = spans_.upper_bound(from);
      if (next != spans_.begin() && std::prev(next)->second > from) {
        from = std::prev(next)->second;
        continue;
      }
      const int until = next == spans_.end() ? end : std::min(end, next->first);
      const int to = std::min(until, from + left_);
      left_ -= to - from;
      spans_[from] = to;
      from = to;
    }
  }

  [[nodiscard]] std::vector<spacetime::FrameSpan> joined() const {
    std::vector<spacetime::FrameSpan> joined;
    for (const auto& [first, end] : spans_) {
      if (!joined.empty() && joined.back().first + joined.back().count == first) {
        joined.back().count += end - first;
      } else {
        joined.push_back({first, end - first});
      }
    }
    return joined;
  }

 private:
  int left_;
  std::map<int, int> spans_;  // first, end
};

}  // namespace

std::vector<spacetime::FrameSpan> choose_early_spans(const std::vector<spacetime::FrameSpan>& views,
                                                     const std::vector<int>& edited,
                                                     int frame_count) {
  Spans spans(kEarlyFrames);
  // Half of the room is for edits, where there are any.
  int left = edited.empty() ? kEarlyFrames : kEarlyFrames / 2;
  for (const auto& view : views) {
    const int count = std::min(left, std::min(view.count, frame_count - view.first));
    spans.add(view.first, view.first + count);
    left -= count;
  }
  for (const int frame : edited)
    spans.add(std::max(0, frame - kAround), std::min(frame_count, frame + kAround + 1));
  return spans.joined();
}

void BodySession::Impl::look_at(spacetime::FrameSpan frames) {
  const int all = document_.unedited()->frame_count;
  if (frames.first < 0 || frames.first >= all)
    throw Error(ErrorCode::kOutOfRange, "first_frame",
                fmt::format("frame {} is outside 0 .. {}", frames.first, all - 1));
  if (frames.count < 1 || frames.count > all - frames.first)
    throw Error(ErrorCode::kOutOfRange, "frame_count",
                fmt::format("{} frames from frame {} on, there are {}", frames.count, frames.first,
                            all - frames.first));
  const std::lock_guard lock(mutex_);
  views_.push_front(frames);
  if (views_.size() > kViews) views_.pop_back();
}

void BodySession::Impl::note_edited(const EditBatch& batch) {
  edited_.clear();
  std::set<std::uint64_t> ids(batch.removed.begin(), batch.removed.end());
  for (const TargetChange& change : batch.moved) ids.insert(change.id);
  for (const scene::Constraint& constraint : batch.set) {
    for (int frame = constraint.frame; frame <= constraint.last_frame(); ++frame)
      edited_.push_back(frame);
    ids.insert(constraint.id);
  }
  if (problem_->started()) {  // where they are, or were
    for (const spacetime::PositionConstraint& constraint : problem_->solver().constraints())
      if (ids.count(constraint_of(constraint.id)) > 0) edited_.push_back(constraint.frame);
  }
  if (batch.keyframes) {
    for (const scene::Keyframe& keyframe : *batch.keyframes) edited_.push_back(keyframe.frame);
  }
}

void BodySession::Impl::publish_early(const Round& round, const spacetime::SolveReport& report) {
  const int frames = document_.unedited()->frame_count;
  if (!listener_ || frames < kLongMotion || !listener_->wants_early_frames()) return;
  const std::vector<spacetime::FrameSpan> views =
      read([this] { return std::vector(views_.begin(), views_.end()); });
  std::vector<std::shared_ptr<const BodyResult>> parts;
  int filled = 0;
  for (const spacetime::FrameSpan& span : choose_early_spans(views, edited_, frames)) {
    filled += problem_->solver().frames_to_fill(span);
    if (filled > kMostFilled) break;
    auto part = std::make_shared<BodyResult>();
    part->revision = round.revision;
    part->report = report;
    part->first_frame = span.first;
    part->modal = problem_->solver().motion_in(span);
    if (!part->modal.allFinite()) return;
    part->material = problem_->material();
    fill_material(*part->material, *part);
    part->unit_force_energy = 0;  // of the whole motion, which is not there yet
    show_by_model(*part);
    part->since_edit_ms = round.since_edit_ms();
    parts.push_back(std::move(part));
  }
  if (parts.empty()) return;
  notify(listener_.get(), [&](BodyListener& listener) { listener.on_early_frames(parts); });
}

}  // namespace limber::session
