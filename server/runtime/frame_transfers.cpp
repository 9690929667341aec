#include "server/runtime/frame_transfers.h"

#include <algorithm>
#include <utility>

#include "engine/base/error.h"

namespace limber::server {

std::list<FrameTransfers::Kept>::iterator FrameTransfers::look_up(std::uint64_t sequence) {
  return std::find_if(kept_.begin(), kept_.end(),
                      [&](const Kept& one) { return one.result->sequence() == sequence; });
}

void FrameTransfers::begin(std::shared_ptr<const FrameSource> result, Clock::time_point now) {
  std::list<Kept> gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  if (const auto known = look_up(result->sequence()); known != kept_.end()) {
    ++known->transfers;
    known->asked = now;
    kept_.splice(kept_.end(), kept_, known);
  } else {
    kept_.push_back({std::move(result), 1, now});
  }
  while (kept_.size() > kMostResults || now - kept_.front().asked > kPatience)
    gone.splice(gone.end(), kept_, kept_.begin());
}

std::shared_ptr<const FrameSource> FrameTransfers::find(std::uint64_t sequence,
                                                        Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto known = look_up(sequence);
  if (known == kept_.end())
    throw Error(ErrorCode::kFailedPrecondition, "result_sequence",
                "the session has no such result any more: begin again with the first part");
  known->asked = now;
  kept_.splice(kept_.end(), kept_, known);
  return known->result;
}

void FrameTransfers::end(std::uint64_t sequence) {
  std::list<Kept> gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  const auto known = look_up(sequence);
  if (known != kept_.end() && --known->transfers == 0) gone.splice(gone.end(), kept_, known);
}

}  // namespace limber::server
