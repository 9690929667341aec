#include "engine/session/core/serial_task.h"

#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace limber::session {
namespace {

TEST(SerialTask, ClosesWithoutWaitingForWorkThatIsNotOver) {
  std::mutex mutex;
  int closed = 0;
  std::thread thread;
  std::promise<void> begun, may_end;
  SerialTask task(
      mutex, [&](std::function<void()> run) { thread = std::thread(std::move(run)); },
      [&] { ++closed; });
  std::string message;
  task.post(
      std::unique_lock(mutex),
      [&] {
        ASSERT_TRUE(task.begin());
        begun.set_value();
        may_end.get_future().wait();
        task.finish(std::unique_lock(mutex));
      },
      message);
  begun.get_future().wait();
  task.close(std::unique_lock(mutex), SerialTask::CloseNotification::kSent,
             SerialTask::Wait::kNone);
  EXPECT_TRUE(task.is_running());
  EXPECT_TRUE(task.is_closed());
  EXPECT_FALSE(task.is_current());
  EXPECT_EQ(closed, 0);
  may_end.set_value();
  task.close(std::unique_lock(mutex), SerialTask::CloseNotification::kSent);  // waits
  EXPECT_FALSE(task.is_running());
  thread.join();
  EXPECT_EQ(closed, 1);
}

}  // namespace
}  // namespace limber::session
