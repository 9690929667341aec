#pragma once

#include <cstdint>
#include <type_traits>

namespace limber {

/// Threads that parallel_for may use, the caller included: $LIMBER_THREADS, else the hardware's.
[[nodiscard]] int thread_count() noexcept;

/// Overrides thread_count() from now on; >= 1.
void set_thread_count(int threads);

/// Which threads help with the loops of the calling thread, from now on. There are three sets of
/// helpers, so that threads of a lower priority do not delay the loops of others. A helper has the
/// priority of the thread that first needed it.
enum class Helpers { kUsual, kRefining, kPatient };
void choose_helpers(Helpers helpers) noexcept;

namespace detail {
using ChunkFunction = void (*)(const void* context, std::int64_t begin, std::int64_t end);
void parallel_for_erased(std::int64_t count, std::int64_t grain, ChunkFunction function,
                         const void* context);
}  // namespace detail

/// Calls fn(begin, end) for the chunks [0, grain), [grain, 2 grain), ... of [0, count), on several
/// threads.
///
/// Chunks do not depend on the number of threads: a chunk writes the same with 1 or 100 of them.
/// Sums are reproducible if each chunk has its own and they are added in order. Calls inside fn run
/// inline. The first exception (of the lowest chunk that threw) is rethrown here once no chunk runs
/// any more; chunks that have not started by then are skipped. May be called from several threads
/// at once.
template <class Function>
void parallel_for(std::int64_t count, std::int64_t grain, Function&& fn) {
  using Plain = std::remove_reference_t<Function>;
  const auto call = [](const void* context, std::int64_t begin, std::int64_t end) {
    (*const_cast<Plain*>(static_cast<const Plain*>(context)))(begin, end);
  };
  detail::parallel_for_erased(count, grain, call, &fn);
}

}  // namespace limber
