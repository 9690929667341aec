// Stores whose bytes are not those that were written: nothing else is passed on as what was.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "engine/base/error.h"
#include "server/log/log.h"
#include "server/store/log_check.h"
#include "server/store/row_seal.h"
#include "tests/server/store/store_fixture.h"

namespace limber::server::store {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string with_flipped(std::string row, std::size_t bit) {
  row[bit / 8] = static_cast<char>(row[bit / 8] ^ (1 << bit % 8));
  return row;
}

class DamagedStore : public StoreTest {
 protected:
  DamagedStore() { log::set_level(log::Level::kOff); }
  ~DamagedStore() override { log::set_level(log::Level::kInfo); }

  /// A session with a checkpoint at 2, edits 3 and 4, and an answer.
  void write_session(Store& store) {
    std::vector<Change> changes{opened(7, "flower")};
    for (std::uint64_t i = 1; i <= 4; ++i) changes.emplace_back(edited(7, i));
    write(store, std::move(changes));
    store.keep_checkpoint(checkpoint_at(7, 2));
    proto::StoredAnswer answer;
    answer.set_sequence(12);
    answer.mutable_result()->set_force_energy(0.125);
    store.keep_answer(7, {answer.SerializeAsString(), "status"});
    store.flush();
    for (int i = 0; i < 6000 && count_in("edits") > 2; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_EQ(count_in("edits"), 2U);
  }
  /// In a store whose server has ended.
  void make_session() {
    Store store(options_);
    write_session(store);
  }
  /// A server begins with the store, and ends.
  void start() { const Store store(options_); }
  /// Why it is refused; empty: it is not.
  static std::string refusal(Store& store) {
    try {
      (void)store.load(7);
      return "";
    } catch (const Error& fault) {
      EXPECT_EQ(fault.code(), ErrorCode::kIo);
      return fault.what();
    }
  }
  void run(const std::string& sql) {
    Database database(options_.file(), Database::Access::kWrite);
    database.run(sql.c_str());
  }
  void write_file(const std::string& suffix, std::size_t bytes) {
    fs::create_directories(options_.folder);
    fs::path file = options_.file();
    std::ofstream(file += suffix, std::ios::binary) << std::string(bytes, 'x');
  }
  std::string refusal_to_start() {
    try {
      start();
      return "";
    } catch (const Error& fault) {
      return fault.what();
    }
  }
};

TEST_F(DamagedStore, AFlippedBitOfARowIsNeverPassedOn) {
  Store store(options_);
  write_session(store);
  const std::string whole = store.load(7).SerializeAsString();
  proto::StoredSession without_answer = store.load(7);
  without_answer.clear_answer();
  const std::string left = without_answer.SerializeAsString();

  Database database(options_.file(), Database::Access::kWrite);
  database.run("PRAGMA synchronous = OFF");
  for (const auto& [table, column] :
       {std::pair{"sessions", "scene"}, std::pair{"seals", "seal"}, std::pair{"edits", "edit"},
        std::pair{"checkpoints", "checkpoint"}, std::pair{"answers", "answer"}}) {
    SCOPED_TRACE(table);
    auto rows =
        database.prepare(fmt::format("SELECT {} FROM {} ORDER BY 1", column, table).c_str());
    ASSERT_TRUE(rows.step());
    const std::string row = rows.bytes(0);
    rows.again();
    auto change = database.prepare(
        fmt::format("UPDATE {0} SET {1} = ? WHERE {1} = ?", table, column).c_str());
    for (std::size_t bit = 0; bit < 8 * row.size(); ++bit) {
      const std::string flipped = with_flipped(row, bit);
      change.again().bind_bytes(flipped).bind_bytes(row).step();
      if (table == std::string("answers"))
        EXPECT_EQ(store.load(7).SerializeAsString(), left) << bit;
      else
        EXPECT_THAT(refusal(store), HasSubstr("damaged in the store")) << bit;
      change.again().bind_bytes(row).bind_bytes(flipped).step();
    }
    EXPECT_EQ(store.load(7).SerializeAsString(), whole);
  }
}

TEST_F(DamagedStore, ARowThatHasLostItsEndIsDamaged) {
  Store store(options_);
  write_session(store);
  for (const char* lost : {"UPDATE edits SET edit = substr(edit, 1, length(edit) - 15)",
                           "UPDATE sessions SET scene = substr(scene, 1, 4)"}) {
    Database database(options_.file(), Database::Access::kWrite);
    database.run("BEGIN");
    database.run(lost);
    database.run("COMMIT");
    EXPECT_THAT(refusal(store), HasSubstr("damaged in the store")) << lost;
  }
}

TEST_F(DamagedStore, NumbersOfRowsAreThoseOfTheirMessages) {
  Store store(options_);
  write_session(store);
  const auto refusal_with = [&](const std::string& change, const std::string& back) {
    run(change);
    std::string why = refusal(store);
    run(back);
    EXPECT_EQ(refusal(store), "");
    return why;
  };
  EXPECT_THAT(
      refusal_with("UPDATE checkpoints SET revision = 66", "UPDATE checkpoints SET revision = 2"),
      HasSubstr("its checkpoint is damaged"));
  EXPECT_THAT(refusal_with("UPDATE edits SET revision = revision + 4",
                           "UPDATE edits SET revision = revision - 4"),
              HasSubstr("session 'flower': its edit 3 is missing"));
  EXPECT_THAT(refusal_with("UPDATE sessions SET revision = 6", "UPDATE sessions SET revision = 4"),
              HasSubstr("its edit 5 is missing in the store"));
}

TEST_F(DamagedStore, EditsAreNotRemovedOnTheWordOfADamagedNumber) {
  make_session();
  run("UPDATE checkpoints SET revision = 66");
  start();
  EXPECT_EQ(count_in("edits"), 2U);
  run("UPDATE checkpoints SET revision = 2; DELETE FROM sessions");
  start();
  EXPECT_EQ(count_in("edits"), 2U) << "of a session that is not listed, nor was removed";
}

TEST_F(DamagedStore, AnAnswerThatIsMissingIsSaid) {
  Store store(options_);
  write_session(store);
  run("DELETE FROM answers");
  log::set_level(log::Level::kInfo);
  ::testing::internal::CaptureStderr();
  EXPECT_FALSE(store.load(7).has_answer());
  EXPECT_THAT(::testing::internal::GetCapturedStderr(),
              HasSubstr("the stored answer of session flower is damaged"));
}

TEST_F(DamagedStore, DamagedStatesAndRepliesAreKnown) {
  Store store(options_);
  write_session(store);
  write(store, {KeptReply{"ana", 3, 4, "reply"}});
  EXPECT_EQ(store.heads().at(0).status, "status");
  EXPECT_EQ(store.replies(kReplySeconds).at(0).reply, "reply");
  run("UPDATE statuses SET status = replace(status, 's', 't');"
      "UPDATE replies SET reply = replace(reply, 'r', 's')");
  EXPECT_EQ(store.heads().at(0).status, "status") << "that of its opening";
  const KeptReply kept = store.replies(kReplySeconds).at(0);
  EXPECT_EQ(kept.reply, "") << "not to be done again";
  EXPECT_EQ(kept.id, 3U);
}

TEST_F(DamagedStore, ASessionThatIsListedWasNotRemoved) {
  make_session();
  run("INSERT INTO removed_sessions VALUES(7)");
  start();
  EXPECT_EQ(count_in("edits"), 2U);
}

TEST_F(DamagedStore, NothingIsWrittenToAFileWhosePagesAreMixedUp) {
  make_session();
  const auto number_of = [&](const char* sql) {
    Database database(options_.file(), Database::Access::kRead);
    auto rows = database.prepare(sql);
    EXPECT_TRUE(rows.step());
    return rows.number(0);
  };
  const std::uint64_t edits = number_of("SELECT rootpage FROM sqlite_master WHERE name = 'edits'");
  run("PRAGMA writable_schema = ON; UPDATE sqlite_master SET rootpage = " + std::to_string(edits) +
      " WHERE name = 'removed_sessions'");
  Store store(options_);
  EXPECT_EQ(refusal(store), "");
  EXPECT_THROW(write(store, {edited(7, 5)}), Error);
  EXPECT_THAT(store.fault(), HasSubstr("is damaged, and nothing is changed in it"));
  EXPECT_EQ(count_in("edits"), 2U);
}

TEST_F(DamagedStore, RowsOfEarlierServersAreRead) {
  std::optional<Store> before(options_);
  EXPECT_EQ(before->begin_run("new").size(), 0U);
  write(*before, {opened(7, "flower"), edited(7, 1)});
  const auto write_unsealed = [&] {
    Database database(options_.file(), Database::Access::kWrite);
    auto change = database.prepare("UPDATE edits SET edit = ?");
    change.bind_bytes(edited(7, 1).edit).step();
  };
  write_unsealed();
  EXPECT_THAT(refusal(*before), HasSubstr("its edit 1 is damaged"));
  before.reset();
  run("INSERT INTO runs VALUES('old', 9)");
  Store store(options_);
  EXPECT_EQ(refusal(store), "") << "an earlier server may have written it since";
  EXPECT_EQ(store.begin_run("newer").size(), 2U);
  write(store, {opened(7, "flower"), edited(7, 1)});
  write_unsealed();
  EXPECT_THAT(refusal(store), HasSubstr("its edit 1 is damaged")) << "opened behind that one";
  run("DELETE FROM seals");
  EXPECT_EQ(refusal(store), "") << "of an earlier server altogether";
}

TEST_F(DamagedStore, AFileThatWasCutOffIsNoNewStore) {
  make_session();
  fs::resize_file(options_.file(), 0);
  EXPECT_THAT(refusal_to_start(), HasSubstr("has a length of 0, but was a store before"));
  fs::remove(options_.file());
  EXPECT_EQ(refusal_to_start(), "") << "somebody wants to begin anew";
}

TEST_F(DamagedStore, ALogWithoutItsFileIsLeftAlone) {
  for (const int length : {-1, 0, 1}) {
    fs::remove_all(options_.folder);
    if (length >= 0) write_file("", static_cast<std::size_t>(length));
    write_file("-wal", 5000);
    EXPECT_THAT(refusal_to_start(), HasSubstr("sessions.sqlite-wal is there")) << length;
    EXPECT_EQ(fs::file_size(options_.file() += "-wal"), 5000U) << length;
  }
}

TEST_F(DamagedStore, AFirstStartThatEndedEarlyIsGoneOnWith) {
  write_file("", 0);
  EXPECT_EQ(refusal_to_start(), "");
}

TEST_F(DamagedStore, TransactionsBehindADamagedFrameOfTheLogAreSaid) {
  const fs::path away = options_.folder / "away";
  const auto log_of = [](fs::path file) { return file += "-wal"; };
  Store store(options_);
  write(store, {opened(7, "flower")});
  for (std::uint64_t i = 1; i <= 20; ++i) write(store, {edited(7, i)});
  fs::copy_file(options_.file(), away);
  std::ifstream in(log_of(options_.file()), std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  const auto lost = [&](const std::string& bytes) {
    std::ofstream(log_of(away), std::ios::binary) << bytes;
    return lost_transactions(log_of(away), 4096);
  };
  EXPECT_EQ(lost(whole), 0U);
  EXPECT_EQ(lost(whole.substr(0, whole.size() - 100)), 0U) << "one that was being written";
  const std::size_t frame = 24 + 4096;
  EXPECT_EQ(lost(with_flipped(whole, 8 * (whole.size() - 4 * frame + 500))), 2U) << "of two pages";
  EXPECT_GT(lost(with_flipped(whole, 8 * 17)), 20U) << "a salt of the log";
  const std::size_t last = whole.size() - frame;
  for (const std::size_t byte : {0, 4, 8, 15, 16, 23, 24, 4119})
    EXPECT_EQ(lost(with_flipped(whole, 8 * (last + byte))), 1U) << byte;
  EXPECT_GT(lost(with_flipped(whole, 8 * 10)), 20U) << "its size of pages";
  EXPECT_EQ(lost(std::string(frame, '\0') + whole.substr(frame)), 1U) << "at least";
  EXPECT_GT(lost(with_flipped(whole, 8 * (32 + frame / 2))), 20U);
}

}  // namespace
}  // namespace limber::server::store
