#include "engine/session/answer_book.h"

#include <algorithm>
#include <utility>

namespace limber::session {
namespace {

std::size_t bytes_of(const Result& result) {
  return static_cast<std::size_t>(result.modal.size()) * sizeof(double) +
         static_cast<std::size_t>(result.coordinates.size()) * sizeof(float);
}

}  // namespace

void AnswerBook::keep(std::uint64_t content, std::shared_ptr<const Result> answer) {
  const auto forget = [&](std::deque<Entry>::iterator entry) {
    bytes_ -= bytes_of(*entry->answer);
    entries_.erase(entry);
  };
  const auto known = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.content == content; });
  if (known != entries_.end()) forget(known);
  bytes_ += bytes_of(*answer);
  entries_.push_back({content, std::move(answer)});
  while (entries_.size() > 1 && (entries_.size() > most_ || bytes_ > most_bytes_))
    forget(entries_.begin());
}

std::shared_ptr<const Result> AnswerBook::find(std::uint64_t content) const {
  for (auto entry = entries_.rbegin(); entry != entries_.rend(); ++entry) {
    if (entry->content == content) return entry->answer;
  }
  return nullptr;
}

}  // namespace limber::session
