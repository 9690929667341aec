#include "server/runtime/frame_transfers.h"

#include <algorithm>
#include <utility>

#include "engine/base/error.h"

namespace limber::server {

FrameTransfers::List::iterator FrameTransfers::look_up(std::uint64_t sequence) {
  return std::find_if(kept_.begin(), kept_.end(),
                      [&](const Kept& one) { return one.result->sequence() == sequence; });
}

void FrameTransfers::touch(List::iterator kept, Clock::time_point now) {
  kept->asked = now;
  kept->is_last_made = false;
  kept_.splice(kept_.end(), kept_, kept);
}

void FrameTransfers::add(const std::shared_ptr<const FrameSource>& result, Clock::time_point now) {
  kept_.push_back({result, now});
  bytes_ += result->kept_bytes();
  const std::string hash = result->basis_hash();
  if (Basis& basis = bases_[hash]; ++basis.results == 1) {
    basis.bytes = result->basis_bytes();
    bytes_ += basis.bytes;
  }
  if (result->sequence() >= newest_) {
    newest_ = result->sequence();
    newest_basis_ = hash;
  }
}

void FrameTransfers::move_to(List& gone, List::iterator kept) {
  bytes_ -= kept->result->kept_bytes();
  const auto basis = bases_.find(kept->result->basis_hash());
  if (--basis->second.results == 0) {
    bytes_ -= basis->second.bytes;
    bases_.erase(basis);
  }
  gone.splice(gone.end(), kept_, kept);
}

std::uint64_t FrameTransfers::bytes_of_all() const {
  const auto shared = bases_.find(newest_basis_);
  return bytes_ - (shared == bases_.end() ? 0 : shared->second.bytes);
}

void FrameTransfers::move_expired(Clock::time_point now, List& gone) {
  for (auto one = kept_.begin(); one != kept_.end();) {
    const auto next = std::next(one);
    if (now - one->asked > (one->is_last_made ? kPatienceBehindLast : kPatience))
      move_to(gone, one);
    one = next;
  }
}

std::shared_ptr<const FrameSource> FrameTransfers::begin(std::shared_ptr<const FrameSource> result,
                                                         WithoutRoom without,
                                                         Clock::time_point now) {
  List gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  if (const auto known = look_up(result->sequence()); known != kept_.end()) {
    touch(known, now);
    return result;
  }
  move_expired(now, gone);
  add(result, now);
  const auto begun = std::prev(kept_.end());
  const auto has_room = [&] { return kept_.size() == 1 || bytes_of_all() <= most_bytes_; };
  for (auto one = kept_.begin(); one != begun && !has_room();) {
    const auto next = std::next(one);
    if (one->is_last_made) move_to(gone, one);
    one = next;
  }
  if (has_room()) return result;
  if (!result->is_final()) {
    for (auto one = std::make_reverse_iterator(begun); one != kept_.rend(); ++one) {
      const FrameSource& earlier = *one->result;
      if (earlier.is_final() || earlier.revision() != result->revision() ||
          earlier.frame_count() != result->frame_count())
        continue;
      const auto shared = std::prev(one.base());
      move_to(gone, begun);
      touch(shared, now);
      return shared->result;
    }
  }
  if (without == WithoutRoom::kBeginNone) {
    move_to(gone, begun);
    return nullptr;
  }
  while (!has_room()) move_to(gone, kept_.begin());
  return result;
}

std::shared_ptr<const FrameSource> FrameTransfers::find(std::uint64_t sequence,
                                                        Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto known = look_up(sequence);
  if (known == kept_.end())
    throw Error(ErrorCode::kFailedPrecondition, "result_sequence",
                "the session has no such result any more: begin again with the first part");
  touch(known, now);
  return known->result;
}

void FrameTransfers::note_last(std::uint64_t sequence) {
  const std::lock_guard lock(mutex_);
  if (const auto known = look_up(sequence); known != kept_.end()) known->is_last_made = true;
}

std::shared_ptr<const FrameSource> FrameTransfers::find_basis(const std::string& basis_hash,
                                                              Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto known = std::find_if(kept_.rbegin(), kept_.rend(), [&](const Kept& one) {
    return one.result->basis_hash() == basis_hash;
  });
  if (known == kept_.rend()) return nullptr;
  known->asked = std::max(known->asked, now);
  return known->result;
}

bool FrameTransfers::sweep(Clock::time_point now) {
  List gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  move_expired(now, gone);
  return !gone.empty();
}

std::uint64_t FrameTransfers::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_of_all();
}

}  // namespace limber::server
