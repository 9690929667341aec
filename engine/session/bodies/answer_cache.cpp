#include "engine/session/bodies/answer_cache.h"

#include <algorithm>
#include <utility>

namespace limber::session {
namespace {

std::size_t bytes_of_answer(const BodyResult& result) {
  const Eigen::Index mixing = result.material ? result.material->mixing.size() : 0;
  return static_cast<std::size_t>(result.modal.size() + mixing) * sizeof(double) +
         static_cast<std::size_t>(result.coordinates.size() * (result.start_of_fit ? 2 : 1)) *
             sizeof(float);
}

}  // namespace

void AnswerCache::keep(std::uint64_t content, std::shared_ptr<const BodyResult> answer) {
  const auto forget = [&](std::deque<Entry>::const_iterator entry) {
    bytes_ -= bytes_of_answer(*entry->answer);
    entries_.erase(entry);
  };
  if (const auto known = entry_of(content); known != entries_.end()) forget(known);
  bytes_ += bytes_of_answer(*answer);
  entries_.push_back({content, std::move(answer)});
  while (entries_.size() > 1 && (entries_.size() > most_ || bytes_ > most_bytes_))
    forget(entries_.begin());
}

std::shared_ptr<const BodyResult> AnswerCache::find(std::uint64_t content) const {
  const auto known = entry_of(content);
  return known != entries_.end() ? known->answer : nullptr;
}

std::deque<AnswerCache::Entry>::const_iterator AnswerCache::entry_of(std::uint64_t content) const {
  return std::find_if(entries_.begin(), entries_.end(),
                      [&](const Entry& entry) { return entry.content == content; });
}

}  // namespace limber::session
