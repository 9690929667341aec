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
  add_seal(row);
  std::string whole = row;
  EXPECT_EQ(take_seal(whole), Seal::kRight);
  EXPECT_EQ(whole, message);
  for (std::size_t bit = 0; bit < 8 * row.size(); ++bit) {
    std::string flipped = row;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << bit % 8));
    const bool is_of_mark = bit / 8 >= message.size() && bit / 8 < row.size() - 8;
    EXPECT_EQ(take_seal(flipped), is_of_mark ? Seal::kNone : Seal::kWrong) << bit;
  }
}

TEST(RowSeal, IsNotThereWhereTheEndIsMissing) {
  std::string row = an_edit().SerializeAsString();
  add_seal(row);
  for (std::size_t length = 0; length < row.size(); ++length) {
    std::string cut = row.substr(0, length);
    EXPECT_EQ(take_seal(cut), Seal::kNone) << length;
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
  add_seal(row);
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
