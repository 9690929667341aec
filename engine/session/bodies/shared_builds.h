#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "engine/base/job.h"
#include "engine/reduced/reduced_model.h"

namespace limber::session {

/// Builds a model that several sessions need at once only once. The first session makes it and the
/// others wait; if the first one is cancelled or fails, one of them makes it. Thread-safe.
class SharedBuilds {
 public:
  using Model = std::shared_ptr<const reduced::ReducedModel>;
  /// Makes the model. The context has the maker's progress, which others see, too.
  using Make = std::function<Model(const JobContext& job)>;
  /// Whether a model that is still in use is given to later callers.
  enum class Keep { kNone, kWhileInUse };

  explicit SharedBuilds(Keep keep) : keep_(keep) {}

  struct Got {
    Model model;
    bool was_waited_for = false;  // another one has made it
  };
  /// @param on_wait  called once before this one waits, if it does
  /// @throws Error{kCancelled} while it waits, and what `make` throws
  [[nodiscard]] Got get(const std::string& key, const JobContext& job, const Make& make,
                        const std::function<void()>& on_wait = {});

 private:
  /// A model that is being made.
  struct Build {
    std::condition_variable changed;
    std::string stage;
    double fraction = 0;
    bool is_over = false;
    Model model;  // null where it could not be made
  };

  /// @returns null where it could not be made
  [[nodiscard]] Model wait_for(const std::shared_ptr<Build>& build, const JobContext& job);
  [[nodiscard]] Model make_for_all(const std::string& key, const std::shared_ptr<Build>& build,
                                   const JobContext& job, const Make& make);
  void end(const std::string& key, const std::shared_ptr<Build>& build, Model model);

  const Keep keep_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Build>> builds_;
  std::map<std::string, std::weak_ptr<const reduced::ReducedModel>> models_;
};

}  // namespace limber::session
