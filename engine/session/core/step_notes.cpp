#include "engine/session/core/step_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "engine/base/error.h"

namespace limber::session {
namespace {

/// @param next  the step of others that would be next; null: none
Error nothing_own(const char* what, bool had_any, const StepNote* next) {
  return {ErrorCode::kFailedPrecondition, "",
          fmt::format("there is nothing {}of yours to {}{}", had_any ? "more " : "", what,
                      next == nullptr
                          ? ""
                          : fmt::format(", the newest edit is by {}: ask for that of anyone",
                                        next->author))};
}

/// Edits without an author belong to all authors, and so to none here.
bool has_any_of(const std::vector<StepNote>& notes, const Author& author) {
  return std::any_of(notes.begin(), notes.end(),
                     [&](const StepNote& note) { return note.author == author; });
}

}  // namespace

void demand_step_given(const StepNote& note, std::uint64_t last) {
  const std::uint64_t number = std::max(note.number, note.takes_back);
  if (number <= last) return;
  throw Error(ErrorCode::kInvalidArgument, "last_number",
              fmt::format("step {} is there, and {} is the last that was given", number, last));
}

StepChoice::StepChoice(std::size_t count, const NoteAt& note, Author author)
    : author_(std::move(author)) {
  // The author's own edit on top decides alone: nearly always, and then older ones are not read.
  if (count > 0 && is_own(note(0)) && note(0).takes_back == 0) count = 1;
  notes_.reserve(count);
  std::set<std::uint64_t> taken_back;
  for (std::size_t age = 0; age < count; ++age) {
    notes_.push_back(note(age));
    const StepNote& step = notes_.back();
    stands_.push_back(taken_back.contains(step.number) ? 0 : 1);
    if (stands_.back() != 0 && step.takes_back != 0) taken_back.insert(step.takes_back);
  }
}

std::optional<std::size_t> StepChoice::to_undo() const {
  for (std::size_t age = 0; age < notes_.size(); ++age) {
    if (stands_[age] == 0 || notes_[age].takes_back != 0 || !is_own(notes_[age])) continue;
    if (age == 0) return std::nullopt;
    return age;
  }
  if (notes_.empty()) return std::nullopt;
  const std::vector<std::size_t> left = above(notes_.size());
  throw nothing_own("undo", has_any_of(notes_, author_),
                    left.empty() ? nullptr : &notes_[left.front()]);
}

std::optional<std::size_t> StepChoice::to_redo(const StepNote* newest) const {
  if (newest != nullptr && is_own(*newest)) return std::nullopt;
  for (std::size_t age = 0; age < notes_.size(); ++age) {
    const StepNote& note = notes_[age];
    if (stands_[age] == 0 || !is_own(note)) continue;
    if (note.takes_back == 0) break;  // edited since
    const auto target = std::find_if(notes_.begin(), notes_.end(), [&](const StepNote& step) {
      return step.number == note.takes_back;
    });
    const bool is_redo = target != notes_.end() && target->takes_back != 0;
    if (!is_redo) return age;
  }
  if (newest == nullptr) return std::nullopt;
  throw nothing_own("redo", has_any_of(notes_, author_), newest);
}

std::vector<std::size_t> StepChoice::above(std::size_t age) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < age; ++i)
    if (stands_[i] != 0 && notes_[i].takes_back == 0) found.push_back(i);
  return found;
}

void refuse_to_take_back(const std::string& what, const Author& since) {
  throw Error(ErrorCode::kFailedPrecondition, "",
              fmt::format("{} was changed since{}: undo that first, by whoever made it or as an "
                          "edit of anyone",
                          what, since.empty() ? "" : fmt::format(" by {}", since)));
}

}  // namespace limber::session
