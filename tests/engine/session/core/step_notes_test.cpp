#include "engine/session/core/step_notes.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/base/error.h"

namespace limber::session {
namespace {

/// Steps, the oldest first, numbered from 1.
struct Steps {
  std::vector<StepNote> notes;
  void made(const Author& author, std::uint64_t takes_back = 0) {
    notes.push_back({author, notes.size() + 1, takes_back});
  }
  [[nodiscard]] StepChoice of(const Author& author) const {
    return {notes.size(),
            [this](std::size_t age) -> const StepNote& { return notes[notes.size() - 1 - age]; },
            author};
  }
};

TEST(StepChoice, TheNewestIsUndoneAsItIsWhereItIsTheAuthorsOwn) {
  Steps steps;
  EXPECT_EQ(steps.of("ana").to_undo(), std::nullopt) << "there is nothing: undo says so itself";
  steps.made("ben");
  steps.made("ana");
  EXPECT_EQ(steps.of("ana").to_undo(), std::nullopt);
  EXPECT_EQ(steps.of("ben").to_undo(), 1U);
  EXPECT_THROW((void)steps.of("eve").to_undo(), Error);
}

TEST(StepChoice, StepsWithoutAnAuthorAreEverybodys) {
  Steps steps;
  steps.made("");
  steps.made("ben");
  EXPECT_EQ(steps.of("ana").to_undo(), 1U);
}

TEST(StepChoice, WhatIsTakenBackIsNotTakenBackAgainUntilItIsBroughtBack) {
  Steps steps;
  steps.made("ana");     // 1
  steps.made("ana");     // 2
  steps.made("ben");     // 3
  steps.made("ana", 2);  // 4: undo
  EXPECT_EQ(steps.of("ana").to_undo(), 3U);
  EXPECT_EQ(steps.of("ana").to_redo(nullptr), 0U);
  EXPECT_EQ(steps.of("ana").above(3), std::vector<std::size_t>{1}) << "ben's, 2 and 4 cancel out";
  steps.made("ana", 1);  // 5: undo
  EXPECT_THROW((void)steps.of("ana").to_undo(), Error);
  steps.made("ana", 5);  // 6: redo of 1
  EXPECT_EQ(steps.of("ana").to_redo(nullptr), 2U) << "then 4, which brings 2 back";
  EXPECT_EQ(steps.of("ana").to_undo(), 5U);
  steps.made("ana", 4);  // 7: redo of 2
  EXPECT_EQ(steps.of("ana").to_redo(nullptr), std::nullopt);
  EXPECT_EQ(steps.of("ana").to_undo(), 5U) << "2 stands again";
}

std::string refusal_of_undo(const Steps& steps, const Author& author) {
  try {
    (void)steps.of(author).to_undo();
  } catch (const Error& fault) {
    return fault.what();
  }
  return "";
}

TEST(StepChoice, WhoHasTakenAllBackIsToldSoAndWhoseEditsAreLeft) {
  Steps steps;
  steps.made("ana");
  steps.made("ana", 1);
  EXPECT_EQ(refusal_of_undo(steps, "ana"), "there is nothing more of yours to undo");
  EXPECT_EQ(refusal_of_undo(steps, "eve"), "there is nothing of yours to undo");
  steps.made("ben");
  steps.made("ana");
  steps.made("ana", 4);
  EXPECT_EQ(
      refusal_of_undo(steps, "ana"),
      "there is nothing more of yours to undo, the newest edit is by ben: ask for that of anyone");
}

TEST(StepChoice, AnEditOfOnesOwnEndsRedo) {
  Steps steps;
  steps.made("ana");     // 1
  steps.made("ben");     // 2
  steps.made("ana", 1);  // 3
  steps.made("ben");     // 4
  EXPECT_EQ(steps.of("ana").to_redo(nullptr), 1U) << "edits of others do not";
  steps.made("ana");
  EXPECT_EQ(steps.of("ana").to_redo(nullptr), std::nullopt);
}

TEST(StepChoice, WhatWasUndoneAsItWasComesBackFirst) {
  Steps steps;
  steps.made("ben");
  const StepNote undone{"ana", 9, 0};
  EXPECT_EQ(steps.of("ana").to_redo(&undone), std::nullopt);
  EXPECT_THROW((void)steps.of("ben").to_redo(&undone), Error);
}

}  // namespace
}  // namespace limber::session
