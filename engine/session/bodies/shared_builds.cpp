#include "engine/session/bodies/shared_builds.h"

#include <chrono>
#include <utility>

#include "engine/base/lent_place.h"

namespace limber::session {

SharedBuilds::Got SharedBuilds::get(const std::string& key, const JobContext& job, const Make& make,
                                    const std::function<void()>& on_wait) {
  for (bool has_waited = false;;) {
    std::shared_ptr<Build> build;
    bool is_own = false;
    {
      const std::lock_guard lock(mutex_);
      if (const auto known = models_.find(key); known != models_.end()) {
        if (Model model = known->second.lock()) return {std::move(model), true};
        models_.erase(known);
      }
      std::shared_ptr<Build>& running = builds_[key];
      is_own = running == nullptr;
      if (is_own) running = std::make_shared<Build>();
      build = running;
    }
    if (is_own) return {make_for_all(key, build, job, make), false};
    if (on_wait && !std::exchange(has_waited, true)) on_wait();
    if (Model model = wait_for(build, job)) return {std::move(model), true};
  }
}

SharedBuilds::Model SharedBuilds::make_for_all(const std::string& key,
                                               const std::shared_ptr<Build>& build,
                                               const JobContext& job, const Make& make) {
  const JobContext shared{job.cancellation, [&](const std::string& stage, double fraction) {
                            {
                              const std::lock_guard lock(mutex_);
                              build->stage = stage;
                              build->fraction = fraction;
                            }
                            build->changed.notify_all();
                            if (job.progress) job.progress(stage, fraction);
                          }};
  try {
    Model model = make(shared);
    end(key, build, model);
    return model;
  } catch (...) {
    end(key, build, nullptr);
    throw;
  }
}

SharedBuilds::Model SharedBuilds::wait_for(const std::shared_ptr<Build>& build,
                                           const JobContext& job) {
  // A cancellation wakes no waiting thread: it is polled.
  constexpr std::chrono::milliseconds kLook{20};
  const LentPlace lent;
  for (;;) {
    std::string stage;
    double fraction = 0;
    {
      std::unique_lock lock(mutex_);
      build->changed.wait_for(lock, kLook, [&] { return build->is_over; });
      if (build->is_over) return build->model;
      stage = build->stage;
      fraction = build->fraction;
    }
    job.report(stage, fraction);
  }
}

void SharedBuilds::end(const std::string& key, const std::shared_ptr<Build>& build, Model model) {
  {
    const std::lock_guard lock(mutex_);
    if (keep_ == Keep::kWhileInUse && model) {
      std::erase_if(models_, [](const auto& one) { return one.second.expired(); });
      models_[key] = model;
    }
    build->is_over = true;
    build->model = std::move(model);
    builds_.erase(key);
  }
  build->changed.notify_all();
}

}  // namespace limber::session
