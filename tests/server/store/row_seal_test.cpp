#include "server/store/row_seal.h"

#include <gtest/gtest.h>

#include "limber/v1/service.pb.h"
#include "limber/v1/stored.pb.h"

namespace limber::server::store {
namespace {

namespace proto = limber::v1;

proto::StoredEdit an_edit() {
  proto::StoredEdit edit;
  edit.set_revision(12);
  edit.set_client_name("Ana");
  auto& move = *edit.add_edits()->mutable_move();
  move.set_id(7);
  move.mutable_target()->set_z(-2.5);
  return edit;
}

TEST(RowSeal, IsWrongBehindEachFlippedBit) {
  const std::string message = an_edit().SerializeAsString();
  std::string row = message;
  add_seal(row, "edits 7 12");
  std::string whole = row;
  EXPECT_EQ(take_seal(whole, "edits 7 12"), Seal::kRight);
  EXPECT_EQ(whole, message);
  for (std::size_t bit = 0; bit < 8 * row.size(); ++bit) {
    std::string flipped = row;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
    const bool is_of_mark = bit / 8 >= message.size() && bit / 8 < row.size() - 8;
    EXPECT_EQ(take_seal(flipped, "edits 7 12"), is_of_mark ? Seal::kNone : Seal::kWrong) << bit;
  }
}

TEST(RowSeal, IsNotThereWhereTheEndIsMissing) {
  std::string row = an_edit().SerializeAsString();
  add_seal(row, "edits 7 12");
  for (std::size_t length = 0; length < row.size(); ++length) {
    std::string cut = row.substr(0, length);
    EXPECT_EQ(take_seal(cut, "edits 7 12"), Seal::kNone) << length;
  }
}

TEST(RowSeal, IsOfThePlaceOfItsRow) {
  for (const std::string& other :
       {place_of("edits", 8, 12), place_of("edits", 7, 13), place_of("answers", 7, 12),
        place_of_reply("7", 12), std::string()}) {
    std::string row = an_edit().SerializeAsString();
    add_seal(row, place_of("edits", 7, 12));
    std::string moved = row;
    EXPECT_EQ(take_seal(row, place_of("edits", 7, 12)), Seal::kRight);
    EXPECT_EQ(take_seal(moved, other), Seal::kWrong) << other;
  }
}

TEST(RowSeal, IsOfAllItsValues) {
  EXPECT_EQ(seal_of({"name", "scene"}), seal_of({"name", "scene"}));
  EXPECT_NE(seal_of({"name", "scene"}), seal_of({"names", "cene"}));
}

/// As servers do that know no seals.
template <class Message>
void expect_passed_over() {
  const auto& type = *Message::descriptor();
  EXPECT_EQ(type.FindFieldByNumber(1000) == nullptr, type.FindFieldByName("seal") == nullptr);
  std::string row;
  add_seal(row, "edits 7 12");
  Message message;
  ASSERT_TRUE(message.ParseFromString(row)) << type.name();
  if (type.FindFieldByName("seal") != nullptr) return;
  EXPECT_EQ(message.GetReflection()->GetUnknownFields(message).field_count(), 1) << type.name();
  message.DiscardUnknownFields();
  EXPECT_EQ(message.ByteSizeLong(), 0U) << type.name();
}

TEST(RowSeal, IsAFieldOfItsOwnInAllThatIsStored) {
  expect_passed_over<proto::StoredEdit>();
  expect_passed_over<proto::StoredAnswer>();
  expect_passed_over<proto::StoredCheckpoint>();
  expect_passed_over<proto::SessionStatus>();
  expect_passed_over<proto::Reply>();
}

}  // namespace
}  // namespace limber::server::store
