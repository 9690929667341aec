// A store whose files go, or are written to by somebody else, is not written any more: nothing is
// acknowledged that would be lost.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <thread>

#include "engine/base/error.h"
#include "tests/server/store/store_fixture.h"

namespace limber::server::store {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class FencedStore : public StoreTest {
 protected:
  /// Why the changes cannot be written; empty: they are.
  static std::string refusal_of(Store& store, std::vector<Change> changes) {
    try {
      write(store, std::move(changes));
      return "";
    } catch (const Error& fault) {
      return fault.what();
    }
  }
  [[nodiscard]] Database another() const { return {options_.file(), Database::Access::kWrite}; }
  [[nodiscard]] std::uint64_t log_bytes() const { return fs::file_size(options_.log()); }
  [[nodiscard]] fs::path lock() const { return options_.folder / "lock"; }
};

TEST_F(FencedStore, OfTwoServersTheOneThatBeganLaterWrites) {
  Store first(options_);
  (void)first.begin_run("first");
  write(first, {opened(7, "flower"), edited(7, 1)});
  fs::remove(lock());
  Store second(options_);
  EXPECT_EQ(second.begin_run("second"), std::set<std::string>{"first"});
  EXPECT_EQ(second.load(7).edits_size(), 1);

  EXPECT_THAT(refusal_of(first, {edited(7, 2)}), HasSubstr("another limberd has begun to write"));
  EXPECT_THAT(first.fault(), HasSubstr("another limberd"));
  EXPECT_EQ(refusal_of(second, {edited(7, 2)}), "");
  EXPECT_EQ(refusal_of(second, {edited(7, 3)}), "");
  EXPECT_THAT(refusal_of(first, {edited(7, 4)}), HasSubstr("another limberd"));
  EXPECT_THAT(refusal_of(first, {ClosedSession{7}}), HasSubstr("another limberd"));
  EXPECT_EQ(second.load(7).edits_size(), 3) << "and none of them is the first server's";
  EXPECT_THAT(second.fault(), IsEmpty());
}

TEST_F(FencedStore, AServerWithoutALockTakesOverFromOneWithout) {
  Store first(options_);
  (void)first.begin_run("first");
  fs::remove(lock());
  Store second(options_);
  (void)second.begin_run("second");
  fs::remove(lock());
  Store third(options_);
  (void)third.begin_run("third");
  EXPECT_THAT(refusal_of(first, {opened(1, "one")}), HasSubstr("another limberd"));
  EXPECT_THAT(refusal_of(second, {opened(2, "two")}), HasSubstr("another limberd"));
  EXPECT_EQ(refusal_of(third, {opened(3, "three")}), "");
  EXPECT_EQ(count_in("sessions"), 1U);
}

TEST_F(FencedStore, NoRowOfSomebodyElseIsReplaced) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1)});
  another().run("INSERT INTO edits VALUES(7, 2, x'00')");
  EXPECT_THAT(refusal_of(store, {edited(7, 2)}), HasSubstr("somebody else has written"));
  EXPECT_THAT(refusal_of(store, {edited(7, 3)}), HasSubstr("somebody else has written"))
      << "it does not go on";
  Database database(options_.file(), Database::Access::kRead);
  auto row = database.prepare("SELECT edit FROM edits WHERE uid = 7 AND revision = 2");
  ASSERT_TRUE(row.step());
  EXPECT_EQ(row.bytes(0), std::string(1, '\0'));
}

TEST_F(FencedStore, NoEditComesBehindANewerRevision) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1)});
  another().run("UPDATE sessions SET revision = 5 WHERE uid = 7");
  EXPECT_THAT(refusal_of(store, {edited(7, 2)}), HasSubstr("comes behind a newer one"));
  EXPECT_EQ(count_in("edits"), 1U);
}

TEST_F(FencedStore, ARemovedLogEndsItAndLosesNothing) {
  {
    Store store(options_);
    (void)store.begin_run("first");
    write(store, {opened(7, "flower"), edited(7, 1)});
    write(store, {edited(7, 2)});
    fs::remove(options_.log());
    EXPECT_THAT(refusal_of(store, {edited(7, 3)}),
                AllOf(HasSubstr("sessions.sqlite-wal was removed"),
                      HasSubstr("all changes that were acknowledged are in the file")));
    EXPECT_THAT(refusal_of(store, {edited(7, 4)}), HasSubstr("was removed"));
  }
  Store again(options_);
  EXPECT_EQ(again.load(7).edits_size(), 2) << "what was acknowledged, and no more";
  (void)again.begin_run("second");
  EXPECT_EQ(refusal_of(again, {edited(7, 3)}), "");
}

TEST_F(FencedStore, AFileThatIsReplacedByItsCopyLosesNothing) {
  {
    Store store(options_);
    (void)store.begin_run("first");
    write(store, {opened(7, "flower"), edited(7, 1)});
    write(store, {edited(7, 2)});
    const fs::path copy = options_.folder / "copy";
    fs::copy_file(options_.file(), copy);
    fs::rename(copy, options_.file());
    for (const std::uint64_t revision : {3, 4})
      EXPECT_THAT(refusal_of(store, {edited(7, revision)}), HasSubstr("removed or moved away"));
    EXPECT_GT(log_bytes(), 0U) << "it has all that the copy lacks";
  }
  Store again(options_);
  EXPECT_EQ(again.load(7).edits_size(), 2) << "what was acknowledged, and no more";
}

TEST_F(FencedStore, ALogThatIsCutOffEndsIt) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1)});
  fs::resize_file(options_.log(), log_bytes() - 1);
  EXPECT_THAT(refusal_of(store, {edited(7, 2)}), HasSubstr("was cut off"));
  EXPECT_THAT(store.fault(), HasSubstr("was cut off"));
}

TEST_F(FencedStore, AnEmptiedLogEndsIt) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1)});
  fs::resize_file(options_.log(), 0);
  EXPECT_THAT(refusal_of(store, {edited(7, 2)}), HasSubstr("was cut off"));
}

TEST_F(FencedStore, ALogInThePlaceOfItsOwnEndsIt) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1)});
  const fs::path copy = options_.folder / "copy";
  fs::copy_file(options_.log(), copy);
  fs::rename(copy, options_.log());
  EXPECT_THAT(refusal_of(store, {edited(7, 2)}), HasSubstr("another file has the place"));
}

TEST_F(FencedStore, AnIndexThatIsRemovedEndsIt) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1)});
  fs::remove(options_.log_index());
  EXPECT_THAT(refusal_of(store, {edited(7, 2)}), HasSubstr("another file has the place"))
      << "others would take locks in another one";
}

TEST_F(FencedStore, ALogThatSomebodyFoldsIsSound) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1)});
  another().run("PRAGMA wal_checkpoint(TRUNCATE)");
  EXPECT_EQ(log_bytes(), 0U);
  for (std::uint64_t revision = 2; revision < 6; ++revision)
    EXPECT_EQ(refusal_of(store, {edited(7, revision)}), "");
  EXPECT_EQ(store.load(7).edits_size(), 5);
}

TEST_F(FencedStore, ALockOfAnotherProcessIsAnErrorThatPasses) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower")});
  {
    Database other = another();
    other.run("BEGIN IMMEDIATE");
    EXPECT_THAT(refusal_of(store, {edited(7, 1)}), HasSubstr("another process holds it"));
    other.run("ROLLBACK");
  }
  for (int i = 0; i < 20'000 && !store.fault().empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(store.fault(), "");
  EXPECT_EQ(refusal_of(store, {edited(7, 2)}), "");
  EXPECT_EQ(store.load(7).edits_size(), 2) << "the first one was kept and is written, too";
}

TEST_F(FencedStore, ACheckpointThatMeetsALockIsWrittenLater) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1), edited(7, 2)});
  {
    Database other = another();
    other.run("BEGIN IMMEDIATE");
    store.keep_checkpoint(checkpoint_at(7, 2));
    store.flush();  // behind the attempt
    other.run("ROLLBACK");
  }
  EXPECT_EQ(count_in("checkpoints"), 0U);
  write(store, {edited(7, 3)});
  EXPECT_EQ(store.end(), 0U);
  EXPECT_EQ(count_in("checkpoints"), 1U);
}

TEST_F(FencedStore, ACheckpointThatMeetsALockDoesNotKeepAServerFromEnding) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), edited(7, 1)});
  Database other = another();
  other.run("BEGIN IMMEDIATE");
  store.keep_checkpoint(checkpoint_at(7, 1));
  EXPECT_EQ(store.end(), 0U);
  other.run("ROLLBACK");
  EXPECT_EQ(count_in("edits"), 1U);
}

TEST_F(FencedStore, LocksAreWaitedForAgainBehindWhatDoesNotWait) {
  Store store(options_);
  Database database = another();
  const auto patience = [&] {
    auto row = database.prepare("PRAGMA busy_timeout");
    return row.step() ? row.number(0) : 0;
  };
  const std::uint64_t before = patience();
  EXPECT_GT(before, 0U);
  {
    const Database::NoWait no_wait(database);
    EXPECT_EQ(patience(), 0U);
  }
  EXPECT_EQ(patience(), before);
}

/// A session whose edits are as long as they may be.
class LongLog : public FencedStore {
 protected:
  static constexpr std::size_t kLong = 1 << 20;
  static EditedSession long_edit(std::uint64_t revision) {
    proto::StoredEdit edit;
    edit.set_revision(revision);
    edit.add_edits()->mutable_undo();
    edit.set_author(std::string(kLong, 'x'));
    return {7, revision, edit.SerializeAsString()};
  }
};

TEST_F(LongLog, IsSaidWhileAReaderHoldsItAndGivenBackBehind) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower")});
  std::uint64_t revision = 0;
  const auto write_beyond_warning = [&] {
    for (std::size_t bytes = 0; bytes <= kUnfoldedBytes; bytes += kLong)
      write(store, {long_edit(++revision)});
  };
  write_beyond_warning();
  EXPECT_EQ(store.warning(), "") << "it is folded again and again";
  EXPECT_LE(log_bytes(), kLogBytes);
  {
    Database reader(options_.file(), Database::Access::kRead);
    reader.run("BEGIN; SELECT count(*) FROM edits");
    write_beyond_warning();
    EXPECT_THAT(store.warning(), HasSubstr("another process reads the store"));
    EXPECT_GT(store.counts().log_bytes, kUnfoldedBytes);
    EXPECT_EQ(store.fault(), "");
  }
  for (int i = 0; i < 3; ++i) write(store, {edited(7, ++revision)});
  EXPECT_EQ(store.warning(), "");
  EXPECT_LE(log_bytes(), kLogBytes);
}

TEST_F(LongLog, OfABoundedStoreIsBounded) {
  options_.bytes = 64 << 20;
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower")});
  std::string refusal;
  {
    Database reader(options_.file(), Database::Access::kRead);
    reader.run("BEGIN; SELECT count(*) FROM edits");
    for (std::uint64_t uid = 100; refusal.empty() && uid < 300; ++uid) {
      refusal = refusal_of(store, {OpenedSession{uid, std::to_string(uid), "bodies",
                                                 std::string(kLong, 'x'), "status"}});
      if (refusal.empty()) refusal = refusal_of(store, {ClosedSession{uid}});
    }
    EXPECT_THAT(refusal, HasSubstr("--data-bytes"));
    EXPECT_LT(log_bytes(), options_.bytes + 2 * kUnfoldedBytes);
  }
  for (int i = 0; i < 20'000 && !store.fault().empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(store.fault(), "") << "the reader has gone";
  EXPECT_EQ(refusal_of(store, {edited(7, 1)}), "");
}

}  // namespace
}  // namespace limber::server::store
