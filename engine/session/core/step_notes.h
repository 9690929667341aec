#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace limber::session {

/// The author of edits, by a name that the caller chooses. Empty: not told; such steps are
/// everybody's.
using Author = std::string;

/// The note of an undo step, besides its values.
struct StepNote {
  Author author;
  std::uint64_t number = 0;      // of its document, never given again
  std::uint64_t takes_back = 0;  // the number of the step that this one takes back; 0: none
};

/// @param last  the greatest number that its document has given
/// @throws Error{kInvalidArgument, "last_number"} for one that was not given by it
void demand_step_given(const StepNote& note, std::uint64_t last);

/// Chooses the step of an Undo or Redo if several authors edit. Their steps depend on each other,
/// so a step below those of others is taken back by a new one on top.
///
/// A step *stands* unless a later one that stands takes it back. Undo is about the author's newest
/// step that stands and takes nothing back. Redo is about the newest that takes such a one back,
/// with no newer edit of the author.
class StepChoice {
 public:
  using NoteAt = std::function<const StepNote&(std::size_t age)>;

  /// @param count  of steps that can be undone
  /// @param note  of them, by age: 0 is the newest
  /// @param author  not empty
  StepChoice(std::size_t count, const NoteAt& note, Author author);

  /// @returns the age of the step; nothing: the newest, which is the author's own edit, is simply
  /// undone
  /// @throws Error{kFailedPrecondition} where none is the author's
  [[nodiscard]] std::optional<std::size_t> to_undo() const;
  /// @param newest  that was undone as it was; null: none
  /// @returns the age of the step that is taken back; nothing: the newest undone step is simply
  /// restored, or there is none
  /// @throws Error{kFailedPrecondition} where none is the author's
  [[nodiscard]] std::optional<std::size_t> to_redo(const StepNote* newest) const;
  /// Edits of others that stand above a step.
  [[nodiscard]] std::vector<std::size_t> above(std::size_t age) const;

 private:
  [[nodiscard]] bool is_own(const StepNote& note) const {
    return note.author.empty() || note.author == author_;
  }

  std::vector<StepNote> notes_;  // by age
  std::vector<char> stands_;
  const Author author_;
};

/// @throws Error{kFailedPrecondition} naming the change since, and its author
[[noreturn]] void refuse_to_take_back(const std::string& what, const Author& since);

}  // namespace limber::session
