#include "server/service/imported_session.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::uint64_t kLargest = kMostImportedNumber - 1;

proto::StoredSession session_of_all_kinds_of_numbers(std::uint64_t number) {
  proto::StoredSession stored;
  auto& checkpoint = *stored.mutable_checkpoint();
  checkpoint.set_revision(5);
  checkpoint.add_makers()->set_revision(number);
  auto& body = *checkpoint.mutable_body();
  body.set_next_constraint(number);
  body.set_last_number(number);
  body.add_undo()->mutable_step()->set_number(number);
  stored.mutable_answer()->set_sequence(number);
  stored.mutable_answer()->mutable_result()->set_revision(number);
  auto& edit = *stored.add_edits();
  edit.set_revision(6);
  edit.set_at_ms(number);
  return stored;
}

/// @returns the field that is refused; empty: none
std::string refused_field(const proto::StoredSession& stored) {
  try {
    demand_countable(stored);
    return "";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.code(), proto::ERROR_CODE_INVALID_ARGUMENT);
    return refusal.field();
  }
}

TEST(ServerImportedSession, NumbersUpToTheLargestAreTaken) {
  EXPECT_EQ(refused_field(session_of_all_kinds_of_numbers(kLargest)), "");
  EXPECT_EQ(refused_field({}), "");
}

TEST(ServerImportedSession, NumbersThatNoServerHasCountedToAreRefusedByName) {
  using Change = std::function<void(proto::StoredSession&)>;
  constexpr std::uint64_t kTooLarge = kMostImportedNumber;
  const std::vector<std::pair<std::string, Change>> changes{
      {"checkpoint.revision",
       [](auto& stored) { stored.mutable_checkpoint()->set_revision(1ULL << 62U); }},
      {"checkpoint.makers[0].revision",
       [](auto& stored) {
         stored.mutable_checkpoint()->mutable_makers(0)->set_revision(kTooLarge);
       }},
      {"checkpoint.body.last_content",
       [](auto& stored) {
         stored.mutable_checkpoint()->mutable_body()->set_last_content(kTooLarge);
       }},
      {"checkpoint.body.last_epoch",
       [](auto& stored) {
         stored.mutable_checkpoint()->mutable_body()->set_last_epoch(kTooLarge);
       }},
      {"checkpoint.body.undo[0].step.number",
       [](auto& stored) {
         auto* step = stored.mutable_checkpoint()->mutable_body()->mutable_undo(0)->mutable_step();
         step->set_number(UINT64_MAX);
       }},
      {"checkpoint.beams.history.last_number",
       [](auto& stored) {
         stored.mutable_checkpoint()->mutable_beams()->mutable_history()->set_last_number(
             kTooLarge);
       }},
      {"answer.sequence", [](auto& stored) { stored.mutable_answer()->set_sequence(kTooLarge); }},
      {"answer.result.revision",
       [](auto& stored) { stored.mutable_answer()->mutable_result()->set_revision(kTooLarge); }},
      {"edits[0].revision", [](auto& stored) { stored.mutable_edits(0)->set_revision(kTooLarge); }},
      {"edits[0].at_ms", [](auto& stored) { stored.mutable_edits(0)->set_at_ms(kTooLarge); }},
  };
  for (const auto& [field, change] : changes) {
    proto::StoredSession stored = session_of_all_kinds_of_numbers(kLargest);
    change(stored);
    EXPECT_EQ(refused_field(stored), "content." + field);
  }
}

TEST(ServerImportedSession, IdsThatClientsOnceChoseAreTaken) {
  constexpr std::uint64_t kOnes = UINT64_MAX;
  proto::StoredSession stored = session_of_all_kinds_of_numbers(kLargest);
  auto& body = *stored.mutable_checkpoint()->mutable_body();
  body.set_next_constraint(kOnes);
  body.set_next_keyframe(kOnes);
  body.mutable_scene()->add_constraints()->set_id(kOnes);
  body.add_keyframes()->mutable_keyframe()->set_id(kOnes);
  for (auto* change : {body.mutable_undo(0)->add_changes(), body.mutable_undo(0)->add_changes()})
    change->mutable_constraint()->set_id(kOnes);
  body.mutable_undo(0)->mutable_changes(0)->set_remove_constraint(kOnes);
  body.mutable_undo(0)->add_changes()->set_remove_keyframe(kOnes);
  body.mutable_undo(0)->add_changes()->mutable_move_constraint()->set_id(kOnes);
  EXPECT_EQ(refused_field(stored), "");
  stored.mutable_checkpoint()->mutable_linkage()->set_last_target(kOnes);
  EXPECT_EQ(refused_field(stored), "");
}

TEST(ServerImportedSession, EditsFollowTheCheckpointWithoutGaps) {
  proto::StoredSession stored = session_of_all_kinds_of_numbers(1);
  stored.add_edits()->set_revision(8);
  EXPECT_EQ(refused_field(stored), "content.edits[1].revision");
  stored.mutable_edits(1)->set_revision(7);
  EXPECT_EQ(refused_field(stored), "");
  stored.mutable_edits(0)->set_revision(5);
  EXPECT_EQ(refused_field(stored), "content.edits[0].revision");
}

}  // namespace
}  // namespace limber::server
