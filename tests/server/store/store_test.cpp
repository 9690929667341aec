#include "server/store/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "engine/base/error.h"
#include "server/log/log.h"
#include "server/store/reserve.h"
#include "server/store/sqlite.h"
#include "tests/server/store/store_fixture.h"

namespace limber::server::store {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(StoreTest, SessionsAreThereAgain) {
  {
    Store store(options_);
    write(store, {opened(7, "flower"), edited(7, 1)});
    write(store, {edited(7, 2)});
    proto::StoredAnswer answer;
    answer.set_sequence(12);
    store.keep_answer(7, {answer.SerializeAsString(), {}});
  }
  Store store(options_);
  const auto heads = store.heads();
  ASSERT_EQ(heads.size(), 1U);
  EXPECT_EQ(heads[0].uid, 7U);
  EXPECT_EQ(heads[0].revision, 2U);
  EXPECT_EQ(heads[0].name, "flower");
  EXPECT_EQ(heads[0].status, "status");
  const proto::StoredSession session = store.load(7);
  EXPECT_EQ(session.scene().name(), "scene of flower");
  ASSERT_EQ(session.edits_size(), 2);
  EXPECT_EQ(session.edits(1).revision(), 2U);
  EXPECT_EQ(session.answer().sequence(), 12U);
}

TEST_F(StoreTest, EditsWithTheBytesOfAConnectionAreRead) {
  proto::StoredEdit first;
  first.set_revision(1);
  first.add_edits()->mutable_undo();
  first.set_client("connection 5:abcde");
  first.set_author("Ana");
  std::string bytes = first.SerializeAsString();
  bytes.replace(bytes.find("abcde"), 5, std::string("\0\x80\xff\xc0\x01", 5));
  Store store(options_);
  write(store, {opened(7, "flower"), EditedSession{7, 1, bytes}, edited(7, 2)});
  const auto session = store.load(7);
  ASSERT_EQ(session.edits_size(), 2);
  EXPECT_EQ(session.edits(0).revision(), 1U);
  EXPECT_EQ(session.edits(0).edits_size(), 1);
  EXPECT_EQ(session.edits(0).author(), "Ana");
  EXPECT_EQ(session.edits(0).client(), "");
  write(store, {EditedSession{7, 3, bytes.substr(0, bytes.size() - 2)}});
  EXPECT_THROW((void)store.load(7), Error) << "it is damaged";
}

TEST_F(StoreTest, OfAnswersTheNewestStays) {
  Store store(options_);
  write(store, {opened(7, "flower")});
  for (std::uint64_t sequence = 1; sequence <= 100; ++sequence) {
    proto::StoredAnswer answer;
    answer.set_sequence(sequence);
    store.keep_answer(7, {answer.SerializeAsString(), std::to_string(sequence)});
  }
  store.flush();
  EXPECT_EQ(store.load(7).answer().sequence(), 100U);
  EXPECT_EQ(store.heads().at(0).status, "100") << "as lists show it";
}

TEST_F(StoreTest, ACheckpointStandsForTheEditsBeforeIt) {
  constexpr std::uint64_t kEdits = 10'000, kAt = 9'990;  // more than are removed at once
  {
    Store store(options_);
    std::vector<Change> changes{opened(7, "flower"), opened(8, "tulip"), edited(8, 1)};
    for (std::uint64_t i = 1; i <= kEdits; ++i) changes.emplace_back(edited(7, i));
    store.append(std::move(changes), nullptr);
    store.flush();
    EXPECT_EQ(store.load(7).version(), Store::kWithoutCheckpoint);
    store.keep_checkpoint(checkpoint_at(7, kAt));
    store.flush();
    for (int again = 0; again < 2; ++again) {
      const proto::StoredSession session = store.load(7);
      EXPECT_EQ(session.version(), Store::kWithCheckpoint);
      EXPECT_EQ(session.checkpoint().revision(), kAt);
      ASSERT_EQ(session.edits_size(), static_cast<int>(kEdits - kAt));
      EXPECT_EQ(session.edits(0).revision(), kAt + 1);
      write(store, {edited(8, 2 + static_cast<std::uint64_t>(again))});
    }
    EXPECT_EQ(store.load(8).edits_size(), 3) << "of another session";
    EXPECT_EQ(store.heads()[0].revision + store.heads()[1].revision, kEdits + 3);
  }
  {
    Store store(options_);  // removes what is left
    for (int i = 0; i < 6000 && count_in("edits") > kEdits - kAt + 3; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_EQ(count_in("edits"), kEdits - kAt + 3);
    EXPECT_EQ(store.load(7).edits_size(), static_cast<int>(kEdits - kAt));
    write(store, {ClosedSession{7}});
    store.keep_checkpoint(checkpoint_at(7, kEdits));  // too late
    store.flush();
    EXPECT_EQ(count_in("checkpoints"), 0U);
  }
  EXPECT_EQ(count_in("edits"), 3U);
}

TEST_F(StoreTest, ACheckpointThatCannotBeWrittenLeavesTheEdits) {
  options_.bytes = 300'000;
  Store store(options_);
  std::vector<Change> changes{opened(7, "flower")};
  for (std::uint64_t i = 1; i <= 100; ++i) changes.emplace_back(edited(7, i));
  write(store, std::move(changes));
  SavedCheckpoint large = checkpoint_at(7, 100);
  large.checkpoint.append(1'000'000, ' ');
  store.keep_checkpoint(std::move(large));
  store.flush();
  write(store, {edited(7, 101)});
  EXPECT_EQ(store.fault(), "");
  EXPECT_EQ(store.load(7).edits_size(), 101);
  EXPECT_EQ(count_in("edits"), 101U);
}

TEST_F(StoreTest, AnOlderCheckpointComesTooLate) {
  Store store(options_);
  std::vector<Change> changes{opened(7, "flower")};
  for (std::uint64_t i = 1; i <= 20; ++i) changes.emplace_back(edited(7, i));
  write(store, std::move(changes));
  for (const std::uint64_t revision : {15, 10}) {
    store.keep_checkpoint(checkpoint_at(7, revision));
    store.flush();
  }
  store.keep_checkpoint(checkpoint_at(7, 16));
  store.keep_checkpoint(checkpoint_at(7, 12));
  store.flush();
  const proto::StoredSession session = store.load(7);
  EXPECT_EQ(session.checkpoint().revision(), 16U);
  ASSERT_EQ(session.edits_size(), 4);
  EXPECT_EQ(session.edits(0).revision(), 17U);
}

TEST_F(StoreTest, OfAClientTheNewestRepliesAreKept) {
  Store store(options_);
  const std::string reply(kReplyBytesOfClient / 100 - 20, ' ');  // and its seal
  for (std::uint64_t id = 1; id <= 250; ++id)
    store.append({KeptReply{"busy", id, 0, reply}}, nullptr);
  store.append({KeptReply{"other", 1, 0, reply}}, nullptr);
  store.flush();
  const auto replies = store.replies(kReplySeconds);
  ASSERT_EQ(replies.size(), 101U);
  for (const KeptReply& one : replies) EXPECT_TRUE(one.client == "other" || one.id > 150) << one.id;
}

TEST_F(StoreTest, OfAClientAsManyRepliesAreKeptAsAServerKnows) {
  Store store(options_);
  constexpr std::uint64_t kReplies = 3 * kRepliesOfClient;
  for (std::uint64_t id = 1; id <= kReplies; ++id)
    store.append({KeptReply{"busy", id, 0, "reply"}}, nullptr);
  store.flush();
  const auto replies = store.replies(kReplySeconds);
  ASSERT_EQ(replies.size(), kRepliesOfClient);
  for (const KeptReply& one : replies) EXPECT_GT(one.id, kReplies - kRepliesOfClient);
}

TEST_F(StoreTest, ARepeatedAttemptToWriteAReplyCountsOnce) {
  StoreOptions full = options_;
  full.retry = std::chrono::milliseconds(1);
  Store store(full);
  write(store, {opened(7, "flower")});
  const fs::path away = fs::path(store.file()) += ".away";
  fs::rename(store.file(), away);
  std::promise<void> refused;
  store.append({KeptReply{"busy", 1, 0, "reply"}},
               [&](const std::exception_ptr&) { refused.set_value(); });
  refused.get_future().get();
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // some attempts
  fs::rename(away, store.file());
  while (!store.fault().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  for (std::uint64_t id = 2; id <= kRepliesOfClient; ++id)
    store.append({KeptReply{"busy", id, 0, "reply"}}, nullptr);
  store.flush();
  EXPECT_EQ(store.replies(kReplySeconds).size(), kRepliesOfClient);
}

TEST_F(StoreTest, AServerThatKnowsNoCheckpointsDoesNotReadThem) {
  const auto form = [&] {
    Database database(options_.file(), Database::Access::kRead);
    auto rows = database.prepare("SELECT version FROM form");
    return rows.step() ? rows.number(0) : 0;
  };
  Store store(options_);
  write(store, {opened(7, "flower"), edited(7, 1)});
  EXPECT_EQ(form(), 1U) << "older servers read it";
  write(store, {checkpoint_at(7, 1)});
  EXPECT_EQ(form(), 2U);
  EXPECT_EQ(store.heads()[0].revision, 1U);
}

TEST_F(StoreTest, AnAnswerIsToldOfOnceItIsWritten) {
  Store store(options_);
  write(store, {opened(7, "flower")});
  proto::StoredAnswer answer;
  answer.set_sequence(12);
  std::promise<std::uint64_t> found;
  store.keep_answer(7, {answer.SerializeAsString(), {}}, [&](const std::exception_ptr& fault) {
    EXPECT_FALSE(fault);
    found.set_value(store.load(7).answer().sequence());
  });
  EXPECT_EQ(found.get_future().get(), 12U);
  store.end();
  bool is_told = false;
  store.keep_answer(7, {answer.SerializeAsString(), {}},
                    [&](const std::exception_ptr& fault) { is_told = fault != nullptr; });
  EXPECT_TRUE(is_told) << "it came too late";
}

TEST_F(StoreTest, EveryAnswerIsToldOfWhenANewerOneIsWritten) {
  Store store(options_);
  write(store, {opened(7, "flower")});
  constexpr int kAnswers = 100;
  std::atomic<int> told{0};
  for (int i = 0; i < kAnswers; ++i)
    store.keep_answer(7, {"", {}}, [&](const std::exception_ptr&) { ++told; });
  store.flush();
  EXPECT_EQ(told, kAnswers);
}

TEST_F(StoreTest, AClosedSessionLeavesNothing) {
  Store store(options_);
  write(store, {opened(7, "flower"), edited(7, 1)});
  store.keep_answer(7, {"", "status"});
  store.flush();
  write(store, {ClosedSession{7}});
  // Those that came too late are of nothing.
  store.keep_answer(7, {"", "status"});
  write(store, {edited(7, 2)});
  EXPECT_THAT(store.heads(), IsEmpty());
  EXPECT_THROW((void)store.load(7), Error);
  Database database(options_.file(), Database::Access::kRead);
  for (const char* const table : {"sessions", "answers", "statuses"}) {
    auto rows = database.prepare((std::string("SELECT count(*) FROM ") + table).c_str());
    ASSERT_TRUE(rows.step());
    EXPECT_EQ(rows.number(0), 0U) << table;
  }
}

TEST_F(StoreTest, ANameIsOfTheNewestSession) {
  Store store(options_);
  write(store, {opened(7, "flower"), edited(7, 1), opened(8, "flower")});
  ASSERT_EQ(store.heads().size(), 1U);
  EXPECT_EQ(store.heads()[0].uid, 8U);
  EXPECT_EQ(store.load(8).edits_size(), 0);
}

TEST_F(StoreTest, WhatWaitsTogetherIsOneCommit) {
  Store store(options_);
  constexpr int kThreads = 8, kEach = 200;
  std::atomic<int> written{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      const auto uid = static_cast<std::uint64_t>(t + 1);
      store.append({opened(uid, "s" + std::to_string(t))}, nullptr);
      for (std::uint64_t i = 1; i <= kEach; ++i)
        store.append({edited(uid, i)}, [&](const std::exception_ptr& fault) { written += !fault; });
    });
  }
  for (auto& thread : threads) thread.join();
  store.flush();
  EXPECT_EQ(written, kThreads * kEach);
  EXPECT_EQ(store.counts().changes, static_cast<std::uint64_t>(kThreads * (kEach + 1)));
  EXPECT_LT(store.counts().commits, static_cast<std::uint64_t>(kThreads * kEach) / 4);
  for (std::uint64_t uid = 1; uid <= kThreads; ++uid)
    EXPECT_EQ(store.load(uid).edits_size(), kEach);
}

TEST_F(StoreTest, AFullFileIsSaidOnceToEveryWriterAndNothingIsLost) {
  options_.bytes = 100'000;
  options_.retry = std::chrono::milliseconds(20);
  {
    Store store(options_);
    write(store, {opened(7, "flower")});
    std::uint64_t stored = 0;
    const std::string large(20'000, 'x');
    proto::StoredEdit edit;
    edit.add_edits()->mutable_add_keyframe()->mutable_keyframe()->mutable_file()->set_content(
        large);
    try {
      while (stored < 100) {
        edit.set_revision(stored + 1);
        write(store, {EditedSession{7, stored + 1, edit.SerializeAsString()}});
        ++stored;
      }
      FAIL() << "the file has room without end";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kIo);
      EXPECT_THAT(error.what(), HasSubstr("full"));
    }
    EXPECT_GT(stored, 0U);
    EXPECT_THAT(store.fault(), HasSubstr("full"));
    EXPECT_EQ(store.load(7).edits_size(), static_cast<int>(stored));
    // What is not to be kept waits for nothing.
    std::promise<void> refused;
    store.append(
        {opened(8, large)},
        [&](const std::exception_ptr& fault) {
          EXPECT_TRUE(fault);
          refused.set_value();
        },
        Store::Keep::kNotAtAll);
    refused.get_future().get();
    // A session that goes makes room: everything goes on.
    store.append({ClosedSession{7}}, nullptr);
    for (int tries = 0; !store.fault().empty() && tries < 200; ++tries)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_THAT(store.fault(), IsEmpty());
    EXPECT_THAT(store.heads(), IsEmpty());
    write(store, {opened(9, "tulip"), edited(9, 1)});
    EXPECT_EQ(store.load(9).edits_size(), 1);
  }
}

TEST_F(StoreTest, AClosingIsWrittenThoughTheFileIsFullAndSaysSo) {
  options_.bytes = 100'000;
  options_.retry = std::chrono::hours(1);  // only what makes room is tried again at once
  Store store(options_);
  write(store, {opened(7, "flower"), opened(8, "tulip")});
  std::vector<Change> changes;
  for (std::uint64_t i = 1; i <= 300; ++i) changes.emplace_back(edited(7, i));
  write(store, std::move(changes));
  EditedSession large = edited(8, 1);
  large.edit.append(200'000, ' ');
  // Together: the edit of `tulip` fails, and with it the transaction.
  std::promise<bool> is_edited;
  store.append({large}, [&](const std::exception_ptr& fault) { is_edited.set_value(!fault); });
  std::promise<bool> is_closed;
  store.append({ClosedSession{7}, KeptReply{"client", 1, 0, "closed"}},
               [&](const std::exception_ptr& fault) { is_closed.set_value(!fault); });
  EXPECT_FALSE(is_edited.get_future().get());
  EXPECT_EQ(store.end(), 1U) << "the edit is lost";
  EXPECT_TRUE(is_closed.get_future().get());
  EXPECT_EQ(count_in("edits"), 0U);
  EXPECT_EQ(count_in("replies"), 1U);
  ASSERT_EQ(store.heads().size(), 1U);
  EXPECT_EQ(store.heads()[0].uid, 8U);
}

TEST_F(StoreTest, AReserveHoldsItsRoomUntilItIsGivenUp) {
  fs::create_directories(options_.folder);
  Reserve reserve(options_.reserve());
  EXPECT_FALSE(reserve.give_up());
  reserve.restore();
  struct stat file {};
  ASSERT_EQ(::stat(options_.reserve().c_str(), &file), 0);
  EXPECT_GE(static_cast<std::uint64_t>(file.st_blocks) * 512, Reserve::kBytes);
  EXPECT_EQ(file.st_mode & 0777U, 0600U);
  EXPECT_TRUE(reserve.give_up());
  EXPECT_FALSE(fs::exists(options_.reserve()));
  EXPECT_FALSE(reserve.give_up());
  reserve.restore();
  EXPECT_TRUE(fs::exists(options_.reserve()));
}

TEST_F(StoreTest, WhatComesBehindTheEndIsRefused) {
  Store store(options_);
  write(store, {opened(7, "flower")});
  EXPECT_EQ(store.end(), 0U);
  EXPECT_THROW(write(store, {edited(7, 1)}), Error);
  EXPECT_EQ(store.load(7).edits_size(), 0);
}

TEST_F(StoreTest, OneServerAtATimeHasTheFolder) {
  Store store(options_);
  try {
    Store other(options_);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(error.what(), HasSubstr(options_.folder.string()));
  }
}

TEST_F(StoreTest, AFileOfANewerFormIsRefused) {
  { Store store(options_); }
  Database(options_.file(), Database::Access::kWrite).run("UPDATE form SET version = 3");
  EXPECT_THROW(Store store(options_), Error);
}

TEST_F(StoreTest, SessionsThatNobodyChangesGoAfterTheirTime) {
  options_.retain = std::chrono::hours(24);
  {
    Store store(options_);
    write(store, {opened(7, "old"), edited(7, 1), opened(8, "new")});
  }
  Database(options_.file(), Database::Access::kWrite)
      .run("UPDATE sessions SET touched = touched - 86500 WHERE uid = 7");
  log::set_level(log::Level::kInfo);
  ::testing::internal::CaptureStderr();
  Store store(options_);
  const std::string said = ::testing::internal::GetCapturedStderr();
  log::set_level(log::Level::kOff);
  EXPECT_THAT(said, HasSubstr("session old is removed"));
  EXPECT_THAT(said, HasSubstr("1 sessions are removed"));
  ASSERT_EQ(store.heads().size(), 1U);
  EXPECT_EQ(store.heads()[0].name, "new");
  EXPECT_THROW((void)store.load(7), Error);
  EXPECT_EQ(count_in("edits"), 0U);
}

TEST_F(StoreTest, RepliesAndRunsAreKnownAgain) {
  {
    Store store(options_);
    EXPECT_THAT(store.begin_run("first"), IsEmpty());
    write(store, {KeptReply{"client a", 3, 99, "reply"}});
  }
  Store store(options_);
  EXPECT_THAT(store.begin_run("second"), ElementsAre("first"));
  const auto replies = store.replies(600);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].client, "client a");
  EXPECT_EQ(replies[0].id, 3U);
  EXPECT_EQ(replies[0].hash, 99U);
  EXPECT_EQ(replies[0].reply, "reply");
}

TEST_F(StoreTest, OptionsAreChecked) {
  options_.retain = std::chrono::seconds(-1);
  EXPECT_THROW(options_.validate(), Error);
  EXPECT_THROW(StoreOptions{}.validate(), Error);
}

}  // namespace
}  // namespace limber::server::store
