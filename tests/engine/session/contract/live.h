#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "tests/engine/session/bodies/harness.h"
#include "tests/engine/session/contract/manual_executor.h"
#include "tests/engine/session/contract/recording.h"

namespace limber::session::contract {

/// A session whose tasks run when the test says so, on its thread, with the notifications of its
/// listener. In the end it must have kept to the rules of Recording.
template <class Kind>
struct Live {
  using Session = typename Kind::Session;
  using Edits = typename Kind::Edits;
  using Recorder = typename Kind::Recorder;

  Live() : Live(Kind::open) {}
  /// @param open  of Kind
  template <class Open>
  explicit Live(const Open& open) : session(open(executor.executor(), recorder)) {}
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;
  ~Live() {
    session.reset();
    executor.run_all();
    EXPECT_EQ(recorder->fault(), "");
  }

  void run() { executor.run_all(); }
  Revision edit(const Edits& edits, std::optional<Revision> expected = {}) {
    return session->edit(edits, expected).revision;
  }
  Revision solve(const Edits& edits) {
    const Revision revision = edit(edits);
    run();
    return revision;
  }
  Revision undo() { return solve({Undo{}}); }
  Revision redo() { return solve({Redo{}}); }
  [[nodiscard]] int number(int client = 0) const { return Kind::number_in(*session, client); }

  /// Of the newest final result, which there must be.
  [[nodiscard]] ResultHeader final_header() const {
    const auto result = Kind::final_result(*session);
    EXPECT_TRUE(result) << "no final result";
    return result ? Kind::header(*result) : ResultHeader();
  }
  /// The same.
  [[nodiscard]] std::vector<double> answer() const {
    const auto result = Kind::final_result(*session);
    EXPECT_TRUE(result) << "no final result";
    return result ? Kind::answer(*result) : std::vector<double>();
  }

  ManualExecutor executor;
  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>();
  std::unique_ptr<Session> session;
};

/// The same with tasks on a thread of its own.
template <class Kind>
struct Threaded {
  using Session = typename Kind::Session;
  using Recorder = typename Kind::Recorder;

  Threaded() : session(Kind::open(pool.executor(), recorder)) {}
  Threaded(const Threaded&) = delete;
  Threaded& operator=(const Threaded&) = delete;
  ~Threaded() {
    session.reset();
    EXPECT_EQ(recorder->fault(), "");
  }

  std::shared_ptr<Recorder> recorder = std::make_shared<Recorder>();
  test::Pool pool{1};
  std::unique_ptr<Session> session;
};

/// Holds one thread until another opens it. Waits last a minute at most, so that a test that fails
/// ends.
class Gate {
 public:
  void pass() {
    std::unique_lock lock(mutex_);
    is_reached_ = true;
    changed_.notify_all();
    changed_.wait_for(lock, kPatience, [&] { return is_open_; });
  }
  /// @returns false where no thread came to pass
  bool wait_reached() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return is_reached_; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }

 private:
  static constexpr std::chrono::seconds kPatience{60};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_reached_ = false, is_open_ = false;
};

/// The error that a call is refused with; the test fails where it is not.
template <class Call>
Error refusal(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "not refused";
  return {ErrorCode::kInternal, "", "not refused"};
}

}  // namespace limber::session::contract
