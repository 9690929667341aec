#include "server/store/backup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "engine/base/error.h"
#include "tests/server/store/store_fixture.h"

namespace limber::server::store {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class BackupTest : public StoreTest {
 protected:
  BackupTest() { fs::remove_all(aside_.folder); }
  ~BackupTest() override { fs::remove_all(aside_.folder); }

  std::string refusal(const fs::path& file, Existing existing = Existing::kIsRefused) const {
    try {
      (void)back_up(options_.folder, file, existing);
      return "";
    } catch (const Error& fault) {
      return fault.field() + ": " + fault.what();
    }
  }
  /// Where a copy has the name of a store's file.
  [[nodiscard]] fs::path copy() const {
    fs::create_directories(aside_.folder);
    return aside_.file();
  }

  StoreOptions aside_{options_.folder.string() + "_aside"};
};

TEST_F(BackupTest, OfAStoreThatIsWrittenIsAStore) {
  Store store(options_);
  (void)store.begin_run("first");
  write(store, {opened(7, "flower"), opened(8, "tulip")});
  std::atomic<bool> is_over{false};
  std::atomic<std::uint64_t> acknowledged{0};
  std::thread writer([&] {
    for (std::uint64_t revision = 1; !is_over; ++revision) {
      write(store, {edited(7, revision), edited(8, revision)});
      acknowledged = revision;
    }
  });
  while (acknowledged < 10) std::this_thread::yield();
  const std::uint64_t before = acknowledged;
  const Backup made = back_up(options_.folder, copy(), Existing::kIsRefused);
  is_over = true;
  writer.join();
  EXPECT_EQ(made.sessions, 2U);
  EXPECT_EQ(made.bytes, fs::file_size(copy()));
  EXPECT_FALSE(fs::exists(aside_.log()));
  EXPECT_FALSE(fs::exists(copy().string() + ".part"));
  struct stat file {};
  ASSERT_EQ(::stat(copy().c_str(), &file), 0);
  EXPECT_EQ(file.st_mode & 0777, 0600U);

  Store again(aside_);
  const auto flower = again.load(7), tulip = again.load(8);
  EXPECT_GE(flower.edits_size(), static_cast<int>(before)) << "all that was acknowledged before";
  EXPECT_EQ(flower.edits_size(), tulip.edits_size()) << "of one moment";
  (void)again.begin_run("second");
  write(again, {edited(7, static_cast<std::uint64_t>(flower.edits_size()) + 1)});
}

TEST_F(BackupTest, OfAFolderWithoutAServerHasItsLog) {
  {
    Store store(options_);
    write(store, {opened(7, "flower"), edited(7, 1)});
    fs::copy(options_.folder, aside_.folder);  // as kill -9 would leave it, with the log
  }
  ASSERT_GT(fs::file_size(aside_.log()), 0U);
  const fs::path file = options_.folder / "copy";
  EXPECT_EQ(back_up(aside_.folder, file, Existing::kIsRefused).sessions, 1U);
  fs::remove_all(aside_.folder);
  fs::create_directories(aside_.folder);
  fs::rename(file, aside_.file());
  EXPECT_EQ(Store(aside_).load(7).edits_size(), 1);
}

TEST_F(BackupTest, OverwritesNothingUnasked) {
  Store store(options_);
  write(store, {opened(7, "flower")});
  std::ofstream(copy()) << "of before";
  EXPECT_THAT(refusal(copy()), HasSubstr("file: "));
  EXPECT_EQ(fs::file_size(copy()), 9U);
  EXPECT_EQ(refusal(copy(), Existing::kIsReplaced), "");
  EXPECT_GT(fs::file_size(copy()), 9U);
  for (const fs::path& own :
       {options_.file(), options_.log(), options_.folder / "." / "sessions.sqlite"})
    EXPECT_THAT(refusal(own, Existing::kIsReplaced), HasSubstr("a file of the store itself"));
}

TEST_F(BackupTest, SaysWhatIsNoStore) {
  EXPECT_THAT(refusal(copy()), HasSubstr("folder: there is no store in"));
  fs::create_directories(options_.folder);
  {
    Database other(options_.file(), Database::Access::kWrite);
    other.run("CREATE TABLE birds(name TEXT)");
  }
  EXPECT_THAT(refusal(copy()), HasSubstr("is not a store of limberd"));
  fs::resize_file(options_.file(), 100);
  EXPECT_THAT(refusal(copy()), HasSubstr("the store "));
  EXPECT_FALSE(fs::exists(copy()));
  EXPECT_FALSE(fs::exists(copy().string() + ".part"));
}

TEST_F(BackupTest, SaysWhereItCannotBeWritten) {
  Store store(options_);
  write(store, {opened(7, "flower")});
  EXPECT_THAT(refusal(options_.folder / "missing" / "copy"), HasSubstr("file: "));
}

}  // namespace
}  // namespace limber::server::store
