#include "tests/engine/session/bodies/harness.h"

#include <gtest/gtest.h>

#ifdef __SANITIZE_THREAD__
// The threads of CHOLMOD meet at barriers of libgomp, which the sanitizer cannot see.
extern "C" const char* __tsan_default_suppressions();
extern "C" const char* __tsan_default_suppressions() {
  return "race:libgomp.so\nrace:cholmod_\nrace:SparseCholesky::Impl::check_pivots\n";
}
#endif

namespace limber::session::test {

using namespace std::chrono_literals;

Pool::Pool(int threads) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { loop(); });
}

Pool::~Pool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

Executor Pool::executor() {
  return [this](std::function<void()> task) {
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
    }
    wake_.notify_one();
  };
}

void Pool::loop() {
  for (;;) {
    std::function<void()> task;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [&] { return stop_ || !tasks_.empty(); });
      if (tasks_.empty()) return;
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    task();
  }
}

/// Marks one call of the listener; two at once are a fault of the session.
struct Recorder::Turn {
  explicit Turn(Recorder& r) : recorder(r) {
    const std::lock_guard lock(recorder.mutex_);
    if (recorder.inside_) recorder.fault_ += "two calls at once; ";
    recorder.inside_ = true;
  }
  ~Turn() {
    {
      const std::lock_guard lock(recorder.mutex_);
      recorder.inside_ = false;
    }
    recorder.changed_.notify_all();
  }
  Recorder& recorder;
};

void Recorder::on_progress(const Progress& progress) {
  const Turn turn(*this);
  if (progress_hook) progress_hook(progress);
  const std::lock_guard lock(mutex_);
  progress_.push_back(progress);
}

void Recorder::on_state(State state, const std::string&) {
  const Turn turn(*this);
  if (state_hook) state_hook(state);
  const std::lock_guard lock(mutex_);
  states_.push_back(state);
}

void Recorder::on_result(const std::shared_ptr<const BodyResult>& result) {
  const Turn turn(*this);
  if (hook) hook(*result);
  const std::lock_guard lock(mutex_);
  if (result->sequence != results_.size() + 1) fault_ += "gap in the sequence; ";
  if (!results_.empty() && result->revision < results_.back()->revision)
    fault_ += "revision goes back; ";
  if (!result->modal.allFinite() || !result->coordinates.allFinite()) fault_ += "not finite; ";
  results_.push_back(result);
}

namespace {

bool is_amendment(const BodyResult& result, const BodyResult* before) {
  return result.check == Check::kDone && before != nullptr && before->check == Check::kPending;
}

}  // namespace

std::shared_ptr<const BodyResult> Recorder::next_solved(std::uint64_t sequence) const {
  const std::lock_guard lock(mutex_);
  for (std::size_t i = sequence; i < results_.size(); ++i) {
    if (!is_amendment(*results_[i], i > 0 ? results_[i - 1].get() : nullptr)) return results_[i];
  }
  return nullptr;
}

std::shared_ptr<const BodyResult> Recorder::wait_final(Revision revision,
                                                       std::uint64_t after_sequence) {
  return wait_result(after_sequence, [=](const BodyResult& result, const BodyResult* before) {
    return result.is_final && !is_amendment(result, before) && result.revision >= revision;
  });
}

std::shared_ptr<const BodyResult> Recorder::wait_checked(Revision revision,
                                                         std::uint64_t after_sequence) {
  return wait_result(after_sequence, [=](const BodyResult& result, const BodyResult*) {
    return result.check == Check::kDone && result.revision >= revision;
  });
}

std::shared_ptr<const BodyResult> Recorder::wait_result(
    std::uint64_t after_sequence,
    const std::function<bool(const BodyResult&, const BodyResult* before)>& is_wanted) {
  std::unique_lock lock(mutex_);
  std::shared_ptr<const BodyResult> found;
  changed_.wait_for(lock, 120s, [&] {
    for (std::size_t i = results_.size(); i-- > 0 && !found;) {
      if (results_[i]->sequence <= after_sequence) break;
      const BodyResult* before = i > 0 ? results_[i - 1].get() : nullptr;
      if (is_wanted(*results_[i], before)) found = results_[i];
    }
    return found != nullptr;
  });
  return found;
}

bool Recorder::wait_state(State state) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, 120s, [&] { return !states_.empty() && states_.back() == state; });
}

std::vector<std::shared_ptr<const BodyResult>> Recorder::results() const {
  const std::lock_guard lock(mutex_);
  return results_;
}

std::vector<State> Recorder::states() const {
  const std::lock_guard lock(mutex_);
  return states_;
}

std::vector<Progress> Recorder::progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

std::string Recorder::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

std::shared_ptr<const BodyResult> solve_fresh(const scene::Scene& scene,
                                              const std::shared_ptr<ModelCache>& cache,
                                              const SessionOptions& options) {
  const auto inline_executor = [](const std::function<void()>& task) { task(); };
  const BodySession session("fresh", scene, options, cache, inline_executor, nullptr);
  return session.final_result();
}

std::shared_ptr<ModelCache> shared_cache() {
  static const TemporaryFolder folder;
  static const auto cache = std::make_shared<ModelCache>(folder.path());
  return cache;
}

}  // namespace limber::session::test
