#include "engine/session/bodies/shared_builds.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <vector>

#include "engine/base/error.h"

namespace limber::session {
namespace {

using Keep = SharedBuilds::Keep;

class SharedBuildsTest : public ::testing::Test {
 protected:
  /// Begins to make a model that is made once `gate_` opens, on a thread of its own.
  std::future<SharedBuilds::Got> begin(const JobContext& job = {}) {
    const int before = made_;
    auto got = std::async(std::launch::async, [this, job] {
      return builds_.get("key", job, [this](const JobContext& own) {
        ++made_;
        while (!is_open_) own.report("stage", 0.5);
        if (fails_) throw Error(ErrorCode::kNumerical, "", "it cannot be made");
        return std::make_shared<const reduced::ReducedModel>();
      });
    });
    while (made_ == before) std::this_thread::yield();
    return got;
  }
  /// Waits for that one. @returns once it does
  std::future<SharedBuilds::Got> join(const JobContext& job = {}) {
    const int before = waiting_;
    auto got = std::async(std::launch::async, [this, job] {
      return builds_.get(
          "key", job,
          [this](const JobContext&) {
            ++made_;
            return std::make_shared<const reduced::ReducedModel>();
          },
          [this] { ++waiting_; });
    });
    while (waiting_ == before) std::this_thread::yield();
    return got;
  }

  SharedBuilds builds_{Keep::kNone};
  std::atomic<bool> is_open_{false}, fails_{false};
  std::atomic<int> made_{0}, waiting_{0};
};

TEST_F(SharedBuildsTest, OneMakesWhatSeveralWantAtOnce) {
  auto first = begin();
  std::vector<std::future<SharedBuilds::Got>> others;
  for (int i = 0; i < 4; ++i) others.push_back(join());
  is_open_ = true;
  const auto made = first.get();
  EXPECT_FALSE(made.was_waited_for);
  for (auto& other : others) {
    const auto got = other.get();
    EXPECT_EQ(got.model, made.model);
    EXPECT_TRUE(got.was_waited_for);
  }
  EXPECT_EQ(made_, 1);
}

TEST_F(SharedBuildsTest, WhoWaitsSeesTheProgress) {
  auto first = begin();
  std::atomic<int> seen{0};
  auto other = join({{}, [&](const std::string& stage, double fraction) {
                       if (stage == "stage" && fraction == 0.5) ++seen;
                     }});
  while (seen == 0) std::this_thread::yield();
  is_open_ = true;
  EXPECT_EQ(other.get().model, first.get().model);
}

TEST_F(SharedBuildsTest, WhereTheFirstIsCancelledAnotherMakesIt) {
  const Cancellation cancellation;
  auto first = begin({cancellation, {}});
  auto other = join(), third = join();
  cancellation.request();
  EXPECT_THROW((void)first.get(), Error);
  const auto got = other.get(), also = third.get();
  EXPECT_NE(got.model, nullptr);
  EXPECT_NE(also.model, nullptr);
  EXPECT_GE(made_, 2);
}

TEST_F(SharedBuildsTest, WhereItCannotBeMadeEachLearnsIt) {
  auto first = begin();
  auto other = join();
  fails_ = true;
  is_open_ = true;
  EXPECT_THROW((void)first.get(), Error);
  EXPECT_NE(other.get().model, nullptr) << "it has tried itself";
}

TEST_F(SharedBuildsTest, WhoWaitsCanBeCancelled) {
  auto first = begin();
  const Cancellation cancellation;
  auto other = join({cancellation, {}});
  cancellation.request();
  try {
    (void)other.get();
    FAIL() << "it was cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
  is_open_ = true;
  EXPECT_NE(first.get().model, nullptr) << "the others go on";
}

TEST(SharedBuilds, ModelsAreKeptWhileTheyAreInUse) {
  int made = 0;
  const auto make = [&](const JobContext&) {
    ++made;
    return std::make_shared<const reduced::ReducedModel>();
  };
  for (const Keep keep : {Keep::kNone, Keep::kWhileInUse}) {
    SharedBuilds builds(keep);
    made = 0;
    auto first = builds.get("key", {}, make).model;
    auto second = builds.get("key", {}, make).model;
    EXPECT_EQ(made, keep == Keep::kNone ? 2 : 1);
    EXPECT_EQ(first == second, keep == Keep::kWhileInUse);
    first.reset();
    second.reset();
    (void)builds.get("key", {}, make);
    EXPECT_EQ(made, keep == Keep::kNone ? 3 : 2) << "nobody had it any more";
  }
}

}  // namespace
}  // namespace limber::session
