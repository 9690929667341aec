#include "engine/base/parallel.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "engine/base/error.h"

namespace limber {
namespace {

class ThreadCount {
 public:
  explicit ThreadCount(int threads) : before_(thread_count()) { set_thread_count(threads); }
  ~ThreadCount() { set_thread_count(before_); }

 private:
  int before_;
};

std::set<std::pair<std::int64_t, std::int64_t>> chunks_of(std::int64_t count, std::int64_t grain) {
  std::mutex mutex;
  std::set<std::pair<std::int64_t, std::int64_t>> chunks;
  parallel_for(count, grain, [&](std::int64_t begin, std::int64_t end) {
    const std::lock_guard lock(mutex);
    EXPECT_TRUE(chunks.emplace(begin, end).second);
  });
  return chunks;
}

TEST(ParallelFor, VisitsEveryIndexOnce) {
  for (const int threads : {1, 2, 7}) {
    const ThreadCount scope(threads);
    std::vector<std::atomic<int>> visits(10007);
    parallel_for(10007, 13, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t i = begin; i < end; ++i) ++visits[i];
    });
    for (const auto& count : visits) ASSERT_EQ(count, 1);
  }
}

TEST(ParallelFor, ChunksDoNotDependOnTheThreadCount) {
  const std::set<std::pair<std::int64_t, std::int64_t>> expected = {{0, 4}, {4, 8}, {8, 10}};
  for (const int threads : {1, 2, 3, 16}) {
    const ThreadCount scope(threads);
    EXPECT_EQ(chunks_of(10, 4), expected);
  }
}

TEST(ParallelFor, NothingToDo) {
  EXPECT_TRUE(chunks_of(0, 4).empty());
  EXPECT_TRUE(chunks_of(-3, 4).empty());
}

TEST(ParallelFor, UsesSeveralThreads) {
  const ThreadCount scope(3);
  // Every chunk waits for the others, so that this ends only if three threads take part.
  std::atomic<int> arrived = 0;
  parallel_for(3, 1, [&](std::int64_t, std::int64_t) {
    ++arrived;
    while (arrived < 3) std::this_thread::yield();
  });
  EXPECT_EQ(arrived, 3);
}

TEST(ParallelFor, ThreadsOfALowPriorityHaveHelpersOfTheirOwn) {
  const ThreadCount scope(3);
  const auto priorities = [] {
    std::mutex mutex;
    std::set<int> found;
    std::atomic<int> arrived = 0;
    parallel_for(3, 1, [&](std::int64_t, std::int64_t) {
      ++arrived;
      while (arrived < 3) std::this_thread::yield();
      const std::lock_guard lock(mutex);
      found.insert(::getpriority(PRIO_PROCESS, 0));
    });
    return found;
  };
  const int usual = ::getpriority(PRIO_PROCESS, 0);
  std::set<int> patient;
  std::thread([&] {
    ASSERT_EQ(::setpriority(PRIO_PROCESS, 0, usual + 3), 0);
    choose_helpers(Helpers::kPatient);
    patient = priorities();
  }).join();
  EXPECT_EQ(patient, std::set<int>{usual + 3});
  EXPECT_EQ(priorities(), std::set<int>{usual});
}

TEST(ParallelFor, RethrowsTheExceptionOfTheLowestChunk) {
  for (const int threads : {1, 4}) {
    const ThreadCount scope(threads);
    try {
      parallel_for(1000, 1, [](std::int64_t begin, std::int64_t) {
        if (begin == 0) throw std::runtime_error("chunk 0");
        if (begin > 500) throw std::runtime_error("later");
      });
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "chunk 0");
    }
    EXPECT_EQ(chunks_of(10, 4).size(), 3u) << "the pool works after an exception";
  }
}

TEST(ParallelFor, NestedCallsRunInline) {
  const ThreadCount scope(4);
  std::atomic<int> visits = 0;
  std::atomic<int> strangers = 0;
  parallel_for(20, 1, [&](std::int64_t, std::int64_t) {
    const auto self = std::this_thread::get_id();
    parallel_for(10, 1, [&](std::int64_t begin, std::int64_t end) {
      visits += static_cast<int>(end - begin);
      if (std::this_thread::get_id() != self) ++strangers;
    });
  });
  EXPECT_EQ(visits, 200);
  EXPECT_EQ(strangers, 0);
}

TEST(ParallelFor, CallsFromSeveralThreadsAtOnce) {
  const ThreadCount scope(3);
  std::vector<std::thread> callers;
  std::atomic<std::int64_t> total = 0;
  for (int caller = 0; caller < 6; ++caller) {
    callers.emplace_back([&] {
      for (int repeat = 0; repeat < 200; ++repeat) {
        std::vector<std::int64_t> sums(50, 0);
        parallel_for(500, 10, [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t i = begin; i < end; ++i) sums[begin / 10] += i;
        });
        for (const std::int64_t sum : sums) total += sum;
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(total, 6 * 200 * (499 * 500 / 2));
}

TEST(ParallelFor, RefusesNoThreads) {
  EXPECT_THROW(set_thread_count(0), Error);
  EXPECT_GE(thread_count(), 1);
}

}  // namespace
}  // namespace limber
