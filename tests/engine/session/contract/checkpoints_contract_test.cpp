// What sessions of kinds that have checkpoints promise of them: who begins at one is where all
// edits lead.
#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "tests/engine/session/contract/kinds.h"
#include "tests/engine/session/contract/live.h"

namespace limber::session::contract {
namespace {

template <class Kind>
class SessionCheckpoints : public ::testing::Test {};
using KindsWithCheckpoints = ::testing::Types<BodyKind, LinkageKind, BeamKind>;
TYPED_TEST_SUITE(SessionCheckpoints, KindsWithCheckpoints, KindNames);

/// One request of one of two people.
template <class Kind>
struct Step {
  typename Kind::Edits edits;
  Author author;
};

template <class Kind>
std::vector<Step<Kind>> random_steps(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Step<Kind>> steps;
  for (int i = 1; i <= count; ++i) {
    const int client = static_cast<int>(random() % 2);
    const Whose whose = random() % 3 == 0 ? Whose::kAnyone : Whose::kOwn;
    Step<Kind> step{{}, client == 0 ? "one" : "other"};
    switch (random() % 8) {
      case 0:
      case 1:
        step.edits = {Undo{whose}};
        break;
      case 2:
        step.edits = {Redo{whose}};
        break;
      case 3:  // two steps in one request
        step.edits = Kind::number(i % 7, client);
        step.edits.emplace_back(Undo{whose});
        step.edits.push_back(Kind::number(i % 5, 1 - client).front());
        break;
      default:
        step.edits = Kind::number(i % 9, client);
    }
    steps.push_back(std::move(step));
  }
  return steps;
}

/// What a request comes to, and what there is then.
template <class Kind>
std::string made(Live<Kind>& live, const Step<Kind>& step) {
  std::string said = "made";
  try {
    (void)live.session->edit(step.edits, std::nullopt, step.author);
  } catch (const Error& error) {
    said = error.what();
  }
  return said + ", revision " + std::to_string(live.session->revision()) + ": " +
         std::to_string(live.number(0)) + ", " + std::to_string(live.number(1));
}

TYPED_TEST(SessionCheckpoints, WhoBeginsAtOneIsWhereAllEditsLead) {
  constexpr int kCount = 120;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const auto steps = random_steps<TypeParam>(kCount, seed);
    const auto at = static_cast<std::size_t>(30 + 15 * seed);
    Live<TypeParam> all, later;
    std::size_t i = 0;
    for (; i < at; ++i) (void)made(all, steps[i]);
    later.session->begin_at(all.session->checkpoint());
    EXPECT_EQ(later.session->revision(), all.session->revision());
    for (; i < steps.size(); ++i) ASSERT_EQ(made(all, steps[i]), made(later, steps[i])) << i;
    // To the end of either, of one's own and of anyone.
    for (const auto& [edit, author] :
         {std::pair<typename TypeParam::Edit, Author>{Undo{Whose::kOwn}, "one"},
          {Redo{Whose::kOwn}, "one"},
          {Undo{Whose::kAnyone}, "other"},
          {Redo{Whose::kAnyone}, "other"}}) {
      for (int back = 0; back < kCount; ++back) {
        const Step<TypeParam> step{{edit}, author};
        ASSERT_EQ(made(all, step), made(later, step)) << back;
      }
    }
  }
}

TYPED_TEST(SessionCheckpoints, TheAnswerIsOfWhatTheEditsMade) {
  Live<TypeParam> all, later;
  for (int i = 1; i <= 5; ++i) all.edit(TypeParam::number(i, i % 2));
  later.session->begin_at(all.session->checkpoint());
  all.run();
  later.run();
  EXPECT_EQ(later.final_header().revision, 5U);
  const auto one = all.answer(), other = later.answer();
  ASSERT_EQ(one.size(), other.size());
  double largest = 0, farthest = 0;
  for (std::size_t k = 0; k < one.size(); ++k) {
    largest = std::max(largest, std::abs(one[k]));
    farthest = std::max(farthest, std::abs(one[k] - other[k]));
  }
  EXPECT_LE(farthest, 1e-6 * largest);
}

TYPED_TEST(SessionCheckpoints, OnlyTheFirstEditIsReplacedByOne) {
  Live<TypeParam> live;
  live.edit(TypeParam::number(1));
  const auto checkpoint = live.session->checkpoint();
  EXPECT_THROW(live.session->begin_at(checkpoint), Error);
  EXPECT_EQ(live.session->revision(), 1U);
  EXPECT_NO_THROW(live.session->demand_reachable(checkpoint));
}

}  // namespace
}  // namespace limber::session::contract
