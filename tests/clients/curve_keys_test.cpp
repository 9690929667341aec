#include "clients/cpp/curve_keys.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "tests/clients/refusal.h"
#include "tests/support/temporary_folder.h"

namespace limber::client {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::string kServer(40, 's'), kPublic(40, 'p'), kSecret(40, 'x');

class CurveKeysTest : public testing::Test {
 protected:
  CurveKeysTest() {
    std::ofstream(secret_) << kSecret << "\n";
    std::ofstream(secret_.string() + ".pub") << kPublic << "\n";
    fs::permissions(secret_, fs::perms::owner_read | fs::perms::owner_write);
  }
  const TemporaryFolder folder_;
  const fs::path secret_ = folder_.path() / "own.key";
};

TEST_F(CurveKeysTest, AreReadFromTheFilesOfKeygen) {
  const CurveKeys keys = read_curve_keys(kServer, secret_);
  EXPECT_EQ(keys.server, kServer);
  EXPECT_EQ(keys.public_key, kPublic);
  EXPECT_EQ(keys.secret_key, kSecret);
}

TEST_F(CurveKeysTest, ASecretThatOthersMayReadIsRefused) {
  for (const fs::perms more : {fs::perms::group_read, fs::perms::others_read,
                               fs::perms::group_write, fs::perms::others_exec}) {
    fs::permissions(secret_, fs::perms::owner_read | fs::perms::owner_write | more);
    const auto error = refusal([&] { (void)read_curve_keys(kServer, secret_); });
    EXPECT_EQ(error.code(), v1::ERROR_CODE_INVALID_ARGUMENT);
    EXPECT_EQ(error.field(), "key");
    EXPECT_THAT(error.what(), HasSubstr("chmod 600 " + secret_.string()));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr(kSecret)));
  }
}

TEST_F(CurveKeysTest, APublicKeyIsTextOrAFileAndNeverTheSecret) {
  EXPECT_EQ(public_key(kPublic, "key"), kPublic);
  EXPECT_EQ(public_key(secret_.string() + ".pub", "key"), kPublic);
  EXPECT_EQ(public_key(secret_.string(), "key"), kPublic);
  fs::remove(secret_.string() + ".pub");
  const auto error = refusal([&] { (void)public_key(secret_.string(), "key"); });
  EXPECT_THAT(error.what(), HasSubstr("may hold a secret key"));
  EXPECT_EQ(refusal([] { (void)public_key("short", "key"); }).field(), "key");
}

}  // namespace
}  // namespace limber::client
