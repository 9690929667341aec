#include "engine/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/base/error.h"

namespace limber {
namespace {

constexpr int kMaximalThreads = 256;

thread_local bool inside_parallel_for = false;

struct InsideScope {
  InsideScope() { inside_parallel_for = true; }
  ~InsideScope() { inside_parallel_for = false; }
};

int initial_thread_count() {
  if (const char* text = std::getenv("LIMBER_THREADS")) {
    int value = 0;
    const char* end = text + std::strlen(text);
    const auto [rest, error] = std::from_chars(text, end, value);
    if (error == std::errc() && rest == end && value >= 1) return std::min(value, kMaximalThreads);
  }
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, kMaximalThreads);
}

std::atomic<int>& thread_limit() {
  static std::atomic<int> limit{initial_thread_count()};
  return limit;
}

/// One call of parallel_for: chunks are handed out in order, whoever asks first gets the next.
class Loop {
 public:
  Loop(std::int64_t count, std::int64_t grain, detail::ChunkFunction function, const void* context)
      : count_(count),
        grain_(grain),
        chunks_((count - 1) / grain + 1),
        function_(function),
        context_(context) {}

  bool exhausted() const { return next_.load(std::memory_order_relaxed) >= chunks_; }

  void work() {
    const InsideScope scope;
    while (true) {
      const std::int64_t chunk = next_.fetch_add(1, std::memory_order_relaxed);
      if (chunk >= chunks_) return;
      try {
        const std::int64_t begin = chunk * grain_;
        function_(context_, begin, std::min(count_ - begin, grain_) + begin);
      } catch (...) {
        note_exception(chunk);
      }
    }
  }

  void rethrow() const {
    if (exception_) std::rethrow_exception(exception_);
  }

  int helpers_wanted = 0;   // guarded by the pool's mutex
  int helpers_running = 0;  // guarded by the pool's mutex

 private:
  void note_exception(std::int64_t chunk) {
    const std::lock_guard lock(exception_mutex_);
    if (chunk < failed_chunk_) {
      failed_chunk_ = chunk;
      exception_ = std::current_exception();
    }
    next_.store(chunks_, std::memory_order_relaxed);
  }

  const std::int64_t count_, grain_, chunks_;
  const detail::ChunkFunction function_;
  const void* const context_;
  std::atomic<std::int64_t> next_{0};
  std::mutex exception_mutex_;
  std::int64_t failed_chunk_ = std::numeric_limits<std::int64_t>::max();
  std::exception_ptr exception_;
};

/// Threads that live as long as the process and help with whatever loop is open.
class Pool {
 public:
  static Pool& instance() {
    static Pool pool;
    return pool;
  }

  ~Pool() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    loop_opened_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  void run(Loop& loop, int helpers) {
    {
      const std::lock_guard lock(mutex_);
      while (static_cast<int>(threads_.size()) < helpers) {
        threads_.emplace_back([this] { help(); });
      }
      loop.helpers_wanted = helpers;
      open_.push_back(&loop);
    }
    for (int i = 0; i < helpers; ++i) loop_opened_.notify_one();
    loop.work();
    std::unique_lock lock(mutex_);
    std::erase(open_, &loop);
    helper_left_.wait(lock, [&] { return loop.helpers_running == 0; });
  }

 private:
  Loop* wanted() const {
    for (Loop* loop : open_) {
      if (loop->helpers_wanted > 0 && !loop->exhausted()) return loop;
    }
    return nullptr;
  }

  void help() {
    std::unique_lock lock(mutex_);
    while (true) {
      Loop* loop = nullptr;
      loop_opened_.wait(lock, [&] { return stopping_ || (loop = wanted()) != nullptr; });
      if (stopping_) return;
      --loop->helpers_wanted;
      ++loop->helpers_running;
      lock.unlock();
      loop->work();
      lock.lock();
      if (--loop->helpers_running == 0) helper_left_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable loop_opened_, helper_left_;
  std::deque<Loop*> open_;
  std::vector<std::thread> threads_;
  bool stopping_ = false;
};

}  // namespace

int thread_count() noexcept { return thread_limit().load(std::memory_order_relaxed); }

void set_thread_count(int threads) {
  if (threads < 1) {
    throw Error(ErrorCode::kInvalidArgument, "threads", "the number of threads must be at least 1");
  }
  thread_limit().store(std::min(threads, kMaximalThreads), std::memory_order_relaxed);
}

void detail::parallel_for_erased(std::int64_t count, std::int64_t grain, ChunkFunction function,
                                 const void* context) {
  LIMBER_DEMAND(grain > 0);
  if (count <= 0) return;
  const std::int64_t chunks = (count - 1) / grain + 1;
  const auto helpers = static_cast<int>(std::min<std::int64_t>(chunks, thread_count())) - 1;
  if (helpers == 0 || inside_parallel_for) {
    for (std::int64_t begin = 0; begin < count; begin += grain) {
      function(context, begin, std::min(count - begin, grain) + begin);
    }
    return;
  }
  Loop loop(count, grain, function, context);
  Pool::instance().run(loop, helpers);
  loop.rethrow();
}

}  // namespace limber
