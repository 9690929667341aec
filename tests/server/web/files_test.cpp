#include "server/web/files.h"

#include <gtest/gtest.h>

#include <fstream>

#include "server/web/compiled_in.h"
#include "tests/support/temporary_folder.h"

namespace limber::server::web {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

TEST(Files, OfAFolderAreReadAsTheyAreNow) {
  const TemporaryFolder folder;
  const Files files(folder.path());
  EXPECT_FALSE(files.find("/"));
  write(folder.path() / "index.html", "one");
  write(folder.path() / "assets/app.js", std::string("a\0b", 3));
  EXPECT_EQ(files.find("/")->bytes, "one");
  EXPECT_EQ(files.find("/")->type, "text/html; charset=utf-8");
  EXPECT_EQ(files.find("/assets/app.js")->bytes, std::string_view("a\0b", 3));
  EXPECT_EQ(files.find("/assets/app.js")->type, "text/javascript; charset=utf-8");
  write(folder.path() / "index.html", "two");
  EXPECT_EQ(files.find("/index.html")->bytes, "two");
}

TEST(Files, NothingOutsideOfTheFolderIsFound) {
  const TemporaryFolder folder;
  const fs::path root = folder.path() / "root";
  write(folder.path() / "secret", "secret");
  write(folder.path() / "root-beside/secret", "secret");
  write(root / ".hidden", "hidden");
  write(root / ".git/config", "hidden");
  write(root / "index.html", "page");
  fs::create_symlink(folder.path() / "secret", root / "link");
  fs::create_symlink(folder.path() / "root-beside", root / "beside");
  fs::create_symlink(root / "index.html", root / "inside");
  const Files files(root);
  for (const std::string_view path :
       {"/../secret", "/%2e%2e/secret", "/./index.html", "//index.html", "/link", "/beside/secret",
        "/.hidden", "/.git/config", "/a\\..\\secret", "index.html", "", "/index.html/", "/missing",
        "/%69ndex.html", "/a/../index.html"}) {
    EXPECT_FALSE(files.find(path)) << path;
  }
  EXPECT_FALSE(files.find(std::string_view("/index.html\0x", 13)));
  EXPECT_EQ(files.find("/inside")->bytes, "page");
}

TEST(Files, CompiledInHaveATag) {
  const Files files({});
  const auto page = files.find("/");
  ASSERT_TRUE(page);
  EXPECT_NE(page->bytes.find("<html"), std::string_view::npos);
  EXPECT_EQ(page->tag.empty(), compiled_in_files().empty());
  EXPECT_FALSE(files.find("/../index.html"));
  for (const CompiledIn& file : compiled_in_files())
    EXPECT_EQ(files.find(std::string("/") + file.path)->bytes.size(),
              static_cast<std::size_t>(file.end - file.begin));
}

}  // namespace
}  // namespace limber::server::web
