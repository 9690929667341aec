#include "server/runtime/hub.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/system/error_code.hpp>
#include <fstream>
#include <thread>
#include <utility>

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

/// Threads for final answers: no more than there are cores, so that solves in progress end soon.
std::size_t refine_threads(const ServerOptions& options) {
  return std::min(solve_threads(options), cores());
}

/// As many as there may be jobs, and some for builds: a session opens even while all jobs run. One
/// more is for short tasks and takes no build: checks of answers wait for no build.
std::size_t session_threads(const ServerOptions& options) {
  constexpr std::size_t kShort = 1;
  if (options.session_threads > 0)
    return static_cast<std::size_t>(options.session_threads) + kShort;
  return options.limits.jobs + cores() + kShort;
}

/// For the calling thread and its helpers, once; its pool has one priority. With this niceness,
/// Linux lets such threads yield as soon as a normal one wakes, and gives them a third or a tenth
/// of the core next to it. Lower ones would hold locks for too long.
void lower_priority(Helpers helpers) {
  constexpr int kOfRefining = 5, kOfPatient = 10, kNicest = 19;
  thread_local bool is_low = false;
  if (std::exchange(is_low, true)) return;
  const int given = ::getpriority(PRIO_PROCESS, 0);
  const int more = helpers == Helpers::kRefining ? kOfRefining : kOfPatient;
  (void)::setpriority(PRIO_PROCESS, 0, std::min(given + more, kNicest));
  choose_helpers(helpers);
}

}  // namespace

Hub::Hub(ServerOptions given)
    : options(validated(std::move(given))),
      transport(options.transport, counters),
      jobs(
          control, options.limits.jobs,
          [this](const proto::JobStatus& status) { publish_job(status); }, run.first_id),
      store(options.store ? std::make_unique<store::Store>(*options.store) : nullptr),
      patient(session_threads(options), [this] { run_patiently(); }),
      solve_pool(solve_threads(options)),
      refine_pool(refine_threads(options)),
      session_pool(session_threads(options) + options.limits.jobs),  // whose places may be lent
      request_pool(static_cast<std::size_t>(options.request_threads)),
      patient_request_pool(static_cast<std::size_t>(options.request_threads)) {}

std::uint64_t Hub::memory_limit() const {
  const std::uint64_t given = options.limits.memory_bytes;
  return given > 0 ? given : std::max<std::uint64_t>(usual_memory(), options.limits.session_bytes);
}

session::Executor Hub::session_executor(const std::string& client) {
  using session::Urgency;
  using Share = TakingTurns::Share;
  // The first patient task of a session is its build. The later ones are shorter (first solves,
  // checks), and must not wait for builds of others, nor for other long tasks.
  auto has_begun = std::make_shared<std::atomic<bool>>(false);
  return [this, client, has_begun, place = NewestFirst::place()](session::Executor::Task task,
                                                                 Urgency urgency) {
    if (urgency == Urgency::kPatient) {
      if (has_begun->exchange(true)) return post_patiently(client, std::move(task), Share::kPart);
      return post_patiently("builds of " + client, std::move(task), Share::kPartButOne);
    }
    if (urgency == Urgency::kLong)  // takes turns with builds: no session waits to open behind it
      return post_patiently("long tasks of " + client, std::move(task), Share::kPartButOne);
    if (urgency == Urgency::kIdle)  // without a request: one at a time, over all sessions
      return post_patiently("idle tasks", std::move(task), Share::kOne);
    if (urgency == Urgency::kRefining) {
      refining.put(place, std::move(task));
      return schedule_refinement();
    }
    refining.withdraw(place);  // the prompt task is in place of it
    boost::asio::post(solve_pool, std::move(task));
  };
}

void Hub::schedule_refinement() {
  auto timer = std::make_shared<boost::asio::steady_timer>(refine_pool, kRefinementDelay);
  timer->async_wait([this, timer](const boost::system::error_code& /*never called off*/) {
    lower_priority(Helpers::kRefining);
    refining.run_one();
  });
}

void Hub::post_patiently(const std::string& client, std::function<void()> task,
                         TakingTurns::Share share) {
  patient.put(client, std::move(task), share);
  run_patiently();
}

void Hub::post_job(std::function<void()> task) {
  patient.put("jobs", std::move(task), TakingTurns::Share::kAll);
  run_patiently();
}

void Hub::run_patiently() {
  boost::asio::post(session_pool, [this] {
    lower_priority(Helpers::kPatient);
    patient.run_one();
  });
}

void Hub::give_way() { lower_priority(Helpers::kPatient); }

Refusal Hub::going_down() const { return shutting_down(next_run()); }

NextRun Hub::next_run() const {
  return is_handed_over.load() ? NextRun::kTakesOver : NextRun::kUnknown;
}

void Hub::publish_job(const proto::JobStatus& status) {
  if (!transport.has_subscriber(kJobsTopic)) return;
  auto message = stream_message(run, status.session(), 0);
  *message.mutable_job() = status;
  transport.publish(kJobsTopic, {message.SerializeAsString()});
}

}  // namespace limber::server
