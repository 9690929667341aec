#include "server/store/row_seal.h"

#include <gtest/gtest.h>

#include "limber/v1/stored.pb.h"

namespace limber::server::store {
namespace {

using limber::v1::StoredEdit;

StoredEdit edit_of(std::uint64_t revision) {
  StoredEdit edit;
  edit.set_revision(revision);
  edit.set_client_name("Ana");
  auto& added = *edit.add_edits()->mutable_move();
  added.set_id(7);
  added.mutable_target()->set_x(0.1);
  added.mutable_target()->set_z(-2.5);
  return edit;
}

std::string flipped(std::string row, std::size_t bit) {
  row[bit / 8] = static_cast<char>(row[bit / 8] ^ (1 << bit % 8));
  return row;
}

TEST(RowSeal, TellsEachFlippedBit) {
  const std::string message = edit_of(12).SerializeAsString();
  const std::string row = sealed(message);
  EXPECT_EQ(unsealed(row).message, message);
  EXPECT_FALSE(unsealed(row).is_damaged);
  for (std::size_t bit = 0; bit < 8 * row.size(); ++bit) {
    const Unsealed found = unsealed(flipped(row, bit));
    if (found.is_damaged) continue;
    // A bit of the mark: the message, which was not hit, is read with the seal as a field.
    StoredEdit edit;
    ASSERT_TRUE(bit / 8 >= message.size());
    if (!edit.ParseFromString(found.message)) continue;
    edit.clear_seal();
    edit.DiscardUnknownFields();
    EXPECT_EQ(edit.SerializeAsString(), message) << bit;
  }
}

TEST(RowSeal, TellsBytesThatAreMissing) {
  const std::string row = sealed(edit_of(12).SerializeAsString());
  for (std::size_t begin = 1; begin < row.size(); ++begin)
    EXPECT_TRUE(unsealed(row.substr(begin)).is_damaged || row.size() - begin < 15) << begin;
}

TEST(RowSeal, IsOfWhatIsBesideTheMessage) {
  const std::string row = sealed("status", {"name", "scene"});
  EXPECT_FALSE(unsealed(row, {"name", "scene"}).is_damaged);
  EXPECT_TRUE(unsealed(row, {"name", "scenf"}).is_damaged);
  EXPECT_TRUE(unsealed(row, {"names", "cene"}).is_damaged);
  EXPECT_TRUE(unsealed(row).is_damaged);
}

TEST(RowSeal, IsNotDemandedOfRowsOfEarlierServers) {
  for (const std::string& row :
       {std::string(), std::string("short"), edit_of(3).SerializeAsString()}) {
    EXPECT_EQ(unsealed(row).message, row);
    EXPECT_FALSE(unsealed(row).is_damaged);
  }
}

TEST(RowSeal, IsPassedOverByServersThatKnowNone) {
  // To them it is a field that is unknown, as one is to StoredMaker.
  limber::v1::StoredMaker maker;
  maker.set_revision(5);
  ASSERT_TRUE(maker.ParseFromString(sealed(maker.SerializeAsString())));
  EXPECT_EQ(maker.revision(), 5U);
}

}  // namespace
}  // namespace limber::server::store
