#include "server/runtime/hub.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <fstream>
#include <thread>

#include "engine/base/parallel.h"
#include "server/runtime/stream_message.h"

namespace limber::server {
namespace {

/// Three quarters of what the machine has, or of what the service may take of it (cgroup v2).
std::uint64_t usual_memory() {
  const auto pages = ::sysconf(_SC_PHYS_PAGES), page = ::sysconf(_SC_PAGESIZE);
  std::uint64_t bytes = pages > 0 && page > 0
                            ? static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page)
                            : 4ull << 30;
  std::ifstream given("/sys/fs/cgroup/memory.max");
  if (std::uint64_t most = 0; given >> most) bytes = std::min(bytes, most);
  return bytes / 4 * 3;
}

ServerOptions validated(ServerOptions options) {
  options.validate();
  return options;
}

std::size_t cores() { return std::max<std::size_t>(2, std::thread::hardware_concurrency()); }

std::size_t solve_threads(const ServerOptions& options) {
  if (options.session_threads > 0) return static_cast<std::size_t>(options.session_threads);
  return 2 * cores();
}

/// As many as there may be jobs, and some that build meanwhile: a session opens beside all of them.
std::size_t session_threads(const ServerOptions& options) {
  if (options.session_threads > 0) return static_cast<std::size_t>(options.session_threads);
  return options.limits.jobs + cores();
}

/// Of the calling thread and its helpers, once. Linux has a thread of this niceness give way as
/// soon as one of the usual wakes, and gives it a tenth of the core beside it: lower ones would
/// hold a lock for long that others wait for.
void lower_priority() {
  constexpr int kNiceness = 10;
  thread_local bool is_low = false;
  if (is_low) return;
  is_low = true;
  (void)::setpriority(PRIO_PROCESS, 0, kNiceness);
  choose_helpers(Helpers::kPatient);
}

}  // namespace

Hub::Hub(ServerOptions given)
    : options(validated(std::move(given))),
      transport(options.transport, counters),
      jobs(
          control, options.limits.jobs,
          [this](const proto::JobStatus& status) { publish_job(status); }, run.first_id),
      store(options.store ? std::make_unique<store::Store>(*options.store) : nullptr),
      solve_pool(solve_threads(options)),
      session_pool(session_threads(options)),
      request_pool(static_cast<std::size_t>(options.request_threads)) {}

std::uint64_t Hub::memory_limit() const {
  const std::uint64_t given = options.limits.memory_bytes;
  return given > 0 ? given : std::max<std::uint64_t>(usual_memory(), options.limits.session_bytes);
}

session::Executor Hub::session_executor() {
  return [this](session::Executor::Task task, session::Urgency urgency) {
    if (urgency == session::Urgency::kPatient) return post_patiently(std::move(task));
    boost::asio::post(solve_pool, std::move(task));
  };
}

void Hub::post_patiently(std::function<void()> task) {
  boost::asio::post(session_pool, [task = std::move(task)] {
    lower_priority();
    task();
  });
}

void Hub::publish_job(const proto::JobStatus& status) {
  if (!transport.has_subscriber(kJobsTopic)) return;
  auto message = stream_message(run, status.session(), 0);
  *message.mutable_job() = status;
  transport.publish(kJobsTopic, {message.SerializeAsString()});
}

}  // namespace limber::server
