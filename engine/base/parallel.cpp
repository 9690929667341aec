#include "engine/base/parallel.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "engine/base/checked_number.h"
#include "engine/base/error.h"

namespace limber {
namespace {

constexpr int kMaximalThreads = 256;

thread_local bool inside_parallel_for = false;
thread_local Helpers chosen_helpers = Helpers::kUsual;

struct InsideScope {
  InsideScope() { inside_parallel_for = true; }
  ~InsideScope() { inside_parallel_for = false; }
};

int initial_thread_count() {
  if (const char* text = std::getenv("LIMBER_THREADS")) {
    const auto value = parse_number<int>(text);
    if (value && *value >= 1) return std::min(*value, kMaximalThreads);
  }
  return std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, kMaximalThreads);
}

std::atomic<int>& thread_limit() {
  static std::atomic<int> limit{initial_thread_count()};
  return limit;
}

/// Chunks that one thread does first, in order; others take from the end.
class alignas(64) Share {
 public:
  void set(std::uint32_t begin, std::uint32_t end) { range_.store(pack(begin, end)); }
  bool exhausted() const { return empty(range_.load(std::memory_order_relaxed)); }

  enum class From { kFront, kBack };
  std::optional<std::uint32_t> take(From from) {
    std::uint64_t range = range_.load(std::memory_order_relaxed);
    while (!empty(range)) {
      const auto begin = static_cast<std::uint32_t>(range >> 32);
      const auto end = static_cast<std::uint32_t>(range);
      const bool front = from == From::kFront;
      const std::uint64_t rest = front ? pack(begin + 1, end) : pack(begin, end - 1);
      if (range_.compare_exchange_weak(range, rest, std::memory_order_relaxed))
        return front ? begin : end - 1;
    }
    return std::nullopt;
  }

 private:
  static std::uint64_t pack(std::uint32_t begin, std::uint32_t end) {
    return std::uint64_t{begin} << 32 | end;
  }
  static bool empty(std::uint64_t range) {
    return static_cast<std::uint32_t>(range >> 32) >= static_cast<std::uint32_t>(range);
  }
  std::atomic<std::uint64_t> range_{0};
};

/// One call of parallel_for. Every thread begins with a share of the chunks that is the same in
/// every loop of this size, so that its results of the last loop are still in its core's cache.
/// Threads that have finished help the others.
class Loop {
 public:
  Loop(std::int64_t count, std::int64_t grain, int threads, detail::ChunkFunction function,
       const void* context)
      : count_(count),
        grain_(grain),
        shares_(std::min(threads, kShares)),
        function_(function),
        context_(context) {
    const std::int64_t chunks = (count - 1) / grain + 1;
    LIMBER_DEMAND(chunks <= std::numeric_limits<std::uint32_t>::max());
    for (int s = 0; s < shares_; ++s) {
      share_[s].set(static_cast<std::uint32_t>(chunks * s / shares_),
                    static_cast<std::uint32_t>(chunks * (s + 1) / shares_));
    }
  }

  bool exhausted() const {
    return std::all_of(share_.begin(), share_.begin() + shares_,
                       [](const Share& share) { return share.exhausted(); });
  }

  /// @param thread  0: the caller's, others: the pool's
  void work(int thread) {
    const InsideScope scope;
    for (int s = 0; s < shares_; ++s) {
      const auto from = s == 0 ? Share::From::kFront : Share::From::kBack;
      Share& share = share_[(thread + s) % shares_];
      while (const std::optional<std::uint32_t> chunk = share.take(from)) run(*chunk);
    }
  }

  void rethrow() const {
    if (exception_) std::rethrow_exception(exception_);
  }

  int helpers_missing = 0;              // guarded by the pool's mutex
  std::atomic<int> helpers_running{0};  // written under the pool's mutex

 private:
  static constexpr int kShares = 16;

  void run(std::int64_t chunk) {
    // Lower ones still run: which exception is rethrown does not depend on who was faster.
    if (chunk > failed_chunk_.load(std::memory_order_relaxed)) return;
    try {
      const std::int64_t begin = chunk * grain_;
      function_(context_, begin, std::min(count_ - begin, grain_) + begin);
    } catch (...) {
      note_exception(chunk);
    }
  }

  void note_exception(std::int64_t chunk) {
    const std::lock_guard lock(exception_mutex_);
    if (chunk < failed_chunk_) {
      failed_chunk_ = chunk;
      exception_ = std::current_exception();
    }
  }

  const std::int64_t count_, grain_;
  const int shares_;
  const detail::ChunkFunction function_;
  const void* const context_;
  std::array<Share, kShares> share_;
  std::mutex exception_mutex_;
  std::atomic<std::int64_t> failed_chunk_{std::numeric_limits<std::int64_t>::max()};
  std::exception_ptr exception_;
};

/// Waits a little for a condition that is usually met at once. To put a thread to sleep and wake it
/// takes longer (5 to 50 us) than the short loops of a Newton step.
template <class Predicate>
void spin_until(const Predicate& there) {
  constexpr std::chrono::microseconds kPatience{200};
  constexpr int kPauses = 32;
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  do {
    for (int i = 0; i < kPauses; ++i) {
      if (there()) return;
      __builtin_ia32_pause();
    }
    std::this_thread::yield();  // to any thread that could use the core
  } while (std::chrono::steady_clock::now() < give_up);
}

/// Threads that live as long as the process and help with any open loop.
class Pool {
 public:
  static Pool& of(Helpers helpers) {
    static std::array<Pool, 3> pools;  // in the order of Helpers
    return pools[static_cast<std::size_t>(helpers)];
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
        const int thread = static_cast<int>(threads_.size()) + 1;
        threads_.emplace_back([this, thread] { help(thread); });
      }
      loop.helpers_missing = helpers;
      open_.push_back(&loop);
      openings_.fetch_add(1, std::memory_order_release);
    }
    for (int i = 0; i < helpers; ++i) loop_opened_.notify_one();
    loop.work(0);
    spin_until([&] { return loop.helpers_running.load(std::memory_order_relaxed) == 0; });
    std::unique_lock lock(mutex_);
    std::erase(open_, &loop);
    helper_left_.wait(lock, [&] { return loop.helpers_running == 0; });
  }

 private:
  Loop* open_loop() const {
    for (Loop* loop : open_) {
      if (loop->helpers_missing > 0 && !loop->exhausted()) return loop;
    }
    return nullptr;
  }

  void help(int thread) {
    std::unique_lock lock(mutex_);
    while (true) {
      Loop* loop = nullptr;
      loop_opened_.wait(lock, [&] { return stopping_ || (loop = open_loop()) != nullptr; });
      if (stopping_) return;
      --loop->helpers_missing;
      ++loop->helpers_running;
      const std::uint64_t last_opening = openings_.load(std::memory_order_relaxed);
      lock.unlock();
      loop->work(thread);
      lock.lock();
      if (--loop->helpers_running == 0) helper_left_.notify_all();
      lock.unlock();
      spin_until([&] { return openings_.load(std::memory_order_acquire) != last_opening; });
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable loop_opened_, helper_left_;
  std::deque<Loop*> open_;
  std::atomic<std::uint64_t> openings_{0};  // written under the mutex
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

void choose_helpers(Helpers helpers) noexcept { chosen_helpers = helpers; }

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
  Loop loop(count, grain, helpers + 1, function, context);
  Pool::of(chosen_helpers).run(loop, helpers);
  loop.rethrow();
}

}  // namespace limber
