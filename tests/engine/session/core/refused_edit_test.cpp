#include "engine/session/core/refused_edit.h"

#include <gtest/gtest.h>

#include <bit>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/base/random.h"

namespace limber::session {
namespace {

/// Edits of which one cannot be taken, or after some of which all together are not valid.
struct SomeEdits {
  std::size_t count = 0;
  std::size_t untakable = ~std::size_t{0};
  std::vector<bool> invalid = {};  // by how many were taken; empty: never
  std::string field = "frame";
  std::size_t attempts = 0;

  void attempt(std::size_t beginning, std::size_t& taken) {
    ++attempts;
    for (std::size_t i = 0; i < beginning; ++i) {
      if (i == untakable) throw Error(ErrorCode::kNotFound, field, "no such thing");
      ++taken;
    }
    if (!invalid.empty() && invalid[beginning])
      throw Error(ErrorCode::kInvalidArgument, field, "contradict each other");
  }
  void try_all() {
    attempts = 0;
    try_edits(count,
              [this](std::size_t beginning, std::size_t& taken) { attempt(beginning, taken); });
  }
  /// The field of what is thrown; "accepted" where nothing is.
  std::string refused() {
    try {
      try_all();
    } catch (const Error& error) {
      return error.field();
    }
    return "accepted";
  }
  void invalid_from(std::size_t edit) {
    invalid.assign(count + 1, false);
    for (std::size_t i = edit + 1; i <= count; ++i) invalid[i] = true;
  }
};

std::string edit_path(std::size_t edit) { return "edits[" + std::to_string(edit) + "].frame"; }

TEST(RefusedEdit, EditsThatAreFineAreTakenOnce) {
  for (const std::size_t count : {0, 1, 7}) {
    SomeEdits edits{count};
    EXPECT_EQ(edits.refused(), "accepted");
    EXPECT_EQ(edits.attempts, 1u);
  }
}

TEST(RefusedEdit, OneThatCannotBeTakenIsNamedWithoutHalving) {
  for (std::size_t edit = 0; edit < 100; ++edit) {
    SomeEdits edits{100, edit};
    EXPECT_EQ(edits.refused(), edit_path(edit));
    EXPECT_LE(edits.attempts, 3u);  // the one that fails, two to find and tell the edit
  }
}

TEST(RefusedEdit, HalvingFindsTheOneThatMakesAllInvalid) {
  for (std::size_t count = 1; count < 40; ++count) {
    for (std::size_t edit = 0; edit < count; ++edit) {
      SomeEdits edits{count};
      edits.invalid_from(edit);
      EXPECT_EQ(edits.refused(), edit_path(edit)) << "of " << count;
      EXPECT_LE(edits.attempts, 2u + static_cast<std::size_t>(std::bit_width(count - 1)));
    }
  }
}

/// Edits are applied before they are checked together, so the later one shows first.
TEST(RefusedEdit, TheEarlierOfTwoFaultsIsNamed) {
  for (std::size_t edit = 0; edit < 9; ++edit) {
    SomeEdits edits{12, 9};
    edits.invalid_from(edit);
    EXPECT_EQ(edits.refused(), edit_path(edit));
  }
  SomeEdits edits{12, 3};
  edits.invalid_from(8);
  EXPECT_EQ(edits.refused(), edit_path(3));
}

TEST(RefusedEdit, WhatIsNamedMadeAnAcceptedBeginningARefusedOne) {
  Random random(4);
  for (int run = 0; run < 300; ++run) {
    SomeEdits edits{1 + static_cast<std::size_t>(random.index(20))};
    for (std::size_t i = 0; i <= edits.count; ++i) edits.invalid.push_back(random.index(2) == 0);
    edits.invalid.front() = false;
    edits.invalid.back() = true;
    const std::string field = edits.refused();
    bool found = false;
    for (std::size_t i = 0; i < edits.count; ++i)
      found = found || (field == edit_path(i) && !edits.invalid[i] && edits.invalid[i + 1]);
    EXPECT_TRUE(found) << field;
  }
}

TEST(RefusedEdit, WithoutAFieldThereIsNoDot) {
  SomeEdits edits{3, 1, {}, ""};
  EXPECT_EQ(edits.refused(), "edits[1]");
}

TEST(RefusedEdit, CodeMessageAndLimitAreThoseOfTheAttempt) {
  SomeEdits edits{3, 2};
  try {
    edits.try_all();
    ADD_FAILURE() << "nothing was refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
    EXPECT_STREQ(error.what(), "no such thing");
  }
  try {
    try_edits(5, [](std::size_t beginning, std::size_t& taken) {
      taken = beginning;
      if (beginning > 3) throw LimitError("keyframe", "too many", 3, beginning);
    });
    ADD_FAILURE() << "nothing was refused";
  } catch (const LimitError& error) {
    EXPECT_EQ(error.field(), "edits[3].keyframe");
    EXPECT_EQ(error.limit(), 3u);
    EXPECT_EQ(error.value(), 4u);
  }
}

TEST(RefusedEdit, OtherFaultsAreNoRefusals) {
  std::size_t attempts = 0;
  const auto fail = [&](std::size_t, std::size_t&) {
    ++attempts;
    throw std::runtime_error("out of memory");
  };
  EXPECT_THROW(try_edits(8, fail), std::runtime_error);
  EXPECT_EQ(attempts, 1u);
}

}  // namespace
}  // namespace limber::session
