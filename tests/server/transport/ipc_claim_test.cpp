#include "server/transport/ipc_claim.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "engine/base/error.h"
#include "tests/support/temporary_folder.h"

namespace limber::server {
namespace {

/// A folder that another process would have locked: locks are of open files, not of processes.
struct ServerIpcClaim : ::testing::Test {
  ServerIpcClaim() { EXPECT_EQ(::flock(file, LOCK_EX), 0); }
  ~ServerIpcClaim() override { ::close(file); }
  /// What it is refused for; empty: it is not.
  std::string refusal() const {
    try {
      const IpcClaim claim("ipc://" + path, "--bind");
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kIo);
      EXPECT_EQ(error.field(), "--bind");
      return error.what();
    }
    return "";
  }

  TemporaryFolder folder;
  std::string path = (folder.path() / "limber.sock").string();
  int file = ::open(folder.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
};

TEST_F(ServerIpcClaim, AFolderThatStaysLockedIsAnErrorInTime) {
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(refusal(), "cannot bind ipc://" + path +
                           ": another process has locked the folder; choose another one");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
  ::flock(file, LOCK_UN);
  EXPECT_EQ(refusal(), "");  // nothing of the first attempt is left
}

TEST_F(ServerIpcClaim, AFolderThatIsUnlockedSoonIsWaitedFor) {
  std::thread other([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    ::flock(file, LOCK_UN);
  });
  EXPECT_EQ(refusal(), "");
  other.join();
}

TEST_F(ServerIpcClaim, FilesThatAreNoSocketsStay) {
  ::flock(file, LOCK_UN);
  std::ofstream(path) << "text";
  EXPECT_NE(refusal().find("a file that is no socket"), std::string::npos);
}

}  // namespace
}  // namespace limber::server
