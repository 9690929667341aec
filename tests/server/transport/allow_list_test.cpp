#include "server/transport/allow_list.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "engine/base/error.h"
#include "server/transport/curve.h"
#include "tests/support/temporary_folder.h"

namespace limber::server {
namespace {

namespace fs = std::filesystem;

std::string a_key() { return make_curve_keys().public_key; }

std::string content(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

/// "FILE:LINE: why"; empty: it is read.
std::string refusal(const std::string& text) {
  try {
    (void)AllowList(text, "allowed").keys();
    return "";
  } catch (const Error& error) {
    return error.field() + ": " + error.what();
  }
}

TEST(AllowList, SaysWhoMayDoWhat) {
  const std::string one = a_key(), two = a_key(), three = a_key();
  const AllowList list("# people\n\n" + one + "\n  " + two +
                           "\tview   # the screen in the hall\r\n" + three +
                           " administer ana@office",
                       "allowed");
  const auto keys = list.keys();
  EXPECT_EQ(keys.size(), 3u);
  EXPECT_EQ(keys.at(one), (Allowed{Role::kEdit, ""}));  // as files of before roles have them
  EXPECT_EQ(keys.at(two), (Allowed{Role::kView, ""}));
  EXPECT_EQ(keys.at(three), (Allowed{Role::kAdminister, "ana@office"}));
  EXPECT_EQ(list.find("ana@office")->key, three);
  EXPECT_EQ(list.find(two)->allowed.role, Role::kView);
  EXPECT_FALSE(list.find("ana"));
  EXPECT_FALSE(list.find(""));  // two have no name
}

TEST(AllowList, BadLinesAreNamed) {
  const std::string one = a_key(), two = a_key();
  const auto is_at = [&](const std::string& text, const std::string& place) {
    const std::string why = refusal(text);
    EXPECT_TRUE(why.starts_with(place)) << text << " -> " << why;
  };
  is_at("too short\n", "allowed:1: is not a Z85 public key");
  is_at(one.substr(0, 35) + std::string(5, '\0') + "\n", "allowed:1: is not a Z85 public key");
  is_at(one + " veiw\n", "allowed:1: 'veiw' is no role");
  is_at("\n" + one + " view a/b\n", "allowed:2: a name is");
  is_at(one + " view " + std::string(65, 'a') + "\n", "allowed:1: a name is");
  is_at(one + " view ana of the office\n", "allowed:1: 'of' behind");
  is_at(one + " view\n" + one + " edit\n", "allowed:2: the key is given before");
  is_at(one + " view ana\n" + two + " view ana\n", "allowed:2: another key has this name");
  EXPECT_EQ(refusal(one + "\n" + one + "\n"), "");
}

TEST(AllowList, ChangesLeaveTheRestAsItIs) {
  const std::string one = a_key(), two = a_key(), three = a_key();
  AllowList list("# people\n" + one + "   # ours\n\n" + two + " view  hall\n", "allowed");
  list.put({one, {Role::kAdminister, "ana"}});
  list.put({three, {Role::kEdit, ""}});
  EXPECT_EQ(list.text(), "# people\n" + one + " administer ana # ours\n\n" + two + " view  hall\n" +
                             three + " edit\n");
  list.remove(two);
  EXPECT_EQ(list.text(), "# people\n" + one + " administer ana # ours\n\n" + three + " edit\n");
  EXPECT_EQ(AllowList(list.text(), "").keys(), list.keys());
  EXPECT_THROW(list.put({"no key", {}}), Error);
  EXPECT_THROW(list.put({three, {Role::kEdit, "two words"}}), Error);
  EXPECT_THROW(list.put({three, {Role::kEdit, "ana"}}), Error);
  EXPECT_NO_THROW(list.put({one, {Role::kView, "ana"}}));
}

TEST(AllowList, FilesAreChangedAsAWhole) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "allowed", link = folder.path() / "link";
  const std::string one = a_key(), two = a_key();
  std::ofstream(file) << one << "\n";
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  fs::create_symlink(file, link);
  const auto before = fs::status(file).permissions();
  const AllowList changed = change_allow_list(link, [&](AllowList& list) {
    list.put({two, {Role::kView, "hall"}});
  });
  EXPECT_EQ(content(file), one + "\n" + two + " view hall\n");
  EXPECT_EQ(read_allow_list(file).keys(), changed.keys());
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(fs::status(file).permissions(), before);
  const auto entries = std::distance(fs::directory_iterator(folder.path()), {});
  EXPECT_EQ(entries, 2);  // nothing is left beside it
  EXPECT_THROW(change_allow_list(file,
                                 [&](AllowList& list) {
                                   list.remove(one);
                                   throw Error(ErrorCode::kInternal, "", "on second thoughts");
                                 }),
               Error);
  EXPECT_EQ(content(file), one + "\n" + two + " view hall\n");
  EXPECT_THROW(change_allow_list(folder.path() / "none", [](AllowList&) {}), Error);
}

TEST(AllowList, OfChangesAtOnceNoneIsLost) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "allowed";
  std::ofstream(file) << "# nobody yet\n";
  const std::string pattern = a_key();
  std::vector<std::thread> threads;
  for (char who = 'a'; who < 'e'; ++who) {
    threads.emplace_back([&, who] {
      for (char i = 'a'; i < 'k'; ++i) {
        std::string key = pattern;
        key[38] = who;
        key[39] = i;
        change_allow_list(file, [&](AllowList& list) { list.put({key, {Role::kView, ""}}); });
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(read_allow_list(file).keys().size(), 40u);
}

TEST(AllowList, OneThatEverybodyMayWriteIsNone) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "allowed";
  std::ofstream(file) << a_key() << "\n";
  fs::permissions(file, fs::perms::others_write, fs::perm_options::add);
  try {
    (void)read_allow_list(file);
    FAIL() << "read";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("chmod o-w " + file.string()), std::string::npos);
  }
}

}  // namespace
}  // namespace limber::server
