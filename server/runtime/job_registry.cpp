#include "server/runtime/job_registry.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/log/log.h"
#include "server/wire/errors.h"
#include "server/wire/session_values.h"

namespace limber::server {
namespace {

constexpr std::size_t kKeptJobs = 256, kKeptProducts = 16, kKeptMotions = 4;
constexpr std::chrono::milliseconds kProgressInterval(50);

}  // namespace

JobId JobRegistry::start(const std::string& kind, const std::string& session, Cancel cancel,
                         Limit limit) {
  JobId id = 0;
  {
    const std::lock_guard lock(mutex_);
    if (limit == Limit::kOfRunning && running_ >= limit_)
      throw limit_exceeded("", "running jobs", limit_, running_ + 1);
    id = ids_.next();
    Job& job = jobs_[id];
    job.status.set_job(id);
    job.status.set_kind(kind);
    job.status.set_session(session);
    job.status.set_state(proto::JOB_STATE_RUNNING);
    job.started = Clock::now();
    job.cancel = std::move(cancel);
    job.is_limited = limit == Limit::kOfRunning;
    if (job.is_limited) ++running_;
    on_change_(status_of(job));
  }
  log::info(log::Fields{{"job", std::to_string(id)}, {"session", session}}, "job {} started: {} {}",
            id, kind, session);
  return id;
}

void JobRegistry::progress(JobId id, const session::Progress& progress) {
  const std::lock_guard lock(mutex_);
  const auto it = jobs_.find(id);
  if (it == jobs_.end() || !it->second.running()) return;
  Job& job = it->second;
  const bool new_stage = job.status.progress().stage() != progress.stage;
  *job.status.mutable_progress() = encode_progress(progress);
  const auto now = Clock::now();
  if (!new_stage && now - job.reported < kProgressInterval) return;
  job.reported = now;
  on_change_(status_of(job));
}

void JobRegistry::done(JobId job, JobProduct product) {
  end(job, proto::JOB_STATE_DONE, nullptr, std::move(product));
}

void JobRegistry::failed(JobId job, const proto::Error& error) {
  end(job, proto::JOB_STATE_FAILED, &error, {});
}

void JobRegistry::cancelled(JobId job) { end(job, proto::JOB_STATE_CANCELLED, nullptr, {}); }

void JobRegistry::end(JobId id, proto::JobState state, const proto::Error* error,
                      JobProduct product) {
  std::vector<Waiter> waiters;
  proto::Reply reply;
  proto::JobStatus status;
  {
    const std::lock_guard lock(mutex_);
    const auto it = jobs_.find(id);
    if (it == jobs_.end() || !it->second.running()) return;
    Job& job = it->second;
    const bool stopped = job.stop_requested && state == proto::JOB_STATE_FAILED;
    job.status.set_elapsed_s(std::chrono::duration<double>(Clock::now() - job.started).count());
    job.status.set_state(stopped ? proto::JOB_STATE_CANCELLED : state);
    if (error != nullptr && !stopped) *job.status.mutable_error() = *error;
    if (state == proto::JOB_STATE_DONE) job.status.mutable_progress()->set_fraction(1);
    job.product = std::move(product);
    job.cancel = nullptr;
    waiters.swap(job.waiters);
    reply = reply_of(job);
    status = job.status;
    if (it->second.is_limited) --running_;
    finished_.push_back(id);
    if (job.product.motion) motions_.push_back(id);
    forget_oldest();
    on_change_(status);
  }
  log::info(log::Fields{{"job", std::to_string(id)},
                        {"session", status.session()},
                        {"error", status.error().message()}},
            "job {} {} after {:.3f} s{}{}", id, proto::JobState_Name(status.state()),
            status.elapsed_s(), status.has_error() ? ": " : "", status.error().message());
  for (auto& waiter : waiters) waiter.ticket->answer(reply);
}

void JobRegistry::forget_oldest() {
  if (motions_.size() > kKeptMotions) {
    const auto oldest = jobs_.find(motions_.front());
    if (oldest != jobs_.end()) oldest->second.product.motion.reset();
    motions_.pop_front();
  }
  if (finished_.size() > kKeptProducts)
    jobs_[finished_[finished_.size() - kKeptProducts - 1]].product = {};
  while (finished_.size() > kKeptJobs) {
    jobs_.erase(finished_.front());
    finished_.pop_front();
  }
}

void JobRegistry::cancel(JobId id) {
  Cancel cancel;
  {
    const std::lock_guard lock(mutex_);
    (void)find(id);
    Job& job = jobs_[id];
    if (!job.running()) return;
    job.stop_requested = true;
    cancel = job.cancel;
  }
  if (cancel) cancel();
}

const JobRegistry::Job& JobRegistry::find(JobId id) const {
  const auto it = jobs_.find(id);
  if (it == jobs_.end() && ids_.is_of_another_run(id))
    throw restarted("job", fmt::format("job {}", id));
  if (it == jobs_.end())
    throw Refusal(proto::ERROR_CODE_NOT_FOUND, "job", fmt::format("there is no job {}", id));
  return it->second;
}

proto::JobStatus JobRegistry::status_of(const Job& job) {
  proto::JobStatus status = job.status;
  if (job.running())
    status.set_elapsed_s(std::chrono::duration<double>(Clock::now() - job.started).count());
  return status;
}

proto::Reply JobRegistry::reply_of(const Job& job) {
  proto::Reply reply;
  auto* response = reply.mutable_get_job();
  *response->mutable_status() = status_of(job);
  if (job.product.mesh.has_nodes()) *response->mutable_mesh() = job.product.mesh;
  for (const auto& issue : job.product.issues) *response->add_issues() = issue;
  if (job.product.simulation) *response->mutable_simulation() = *job.product.simulation;
  if (job.product.recovery) *response->mutable_recovery() = *job.product.recovery;
  if (job.product.tetrahedralization)
    *response->mutable_tetrahedralization() = *job.product.tetrahedralization;
  if (job.product.beams) *response->mutable_beams() = *job.product.beams;
  if (job.product.discretisation_error)
    *response->mutable_discretisation_error() = *job.product.discretisation_error;
  for (const auto& file : job.product.files) *response->add_files() = file;
  return reply;
}

proto::JobStatus JobRegistry::status(JobId job) const {
  const std::lock_guard lock(mutex_);
  return status_of(find(job));
}

std::shared_ptr<const JobMotion> JobRegistry::motion(JobId id) const {
  const std::lock_guard lock(mutex_);
  const Job& job = find(id);
  if (job.product.motion) return job.product.motion;
  const bool makes_one = job.status.kind() == "simulate" || job.status.kind() == "recover";
  const char* why = job.running() ? "still runs"
                    : !makes_one  ? "made no motion"
                    : job.status.state() == proto::JOB_STATE_DONE
                        ? "is too old: its motion is no longer kept"
                        : "ended without a motion";
  throw Refusal(proto::ERROR_CODE_FAILED_PRECONDITION, "job", fmt::format("job {} {}", id, why));
}

void JobRegistry::publish_running() const {
  const std::lock_guard lock(mutex_);
  for (const auto& [id, job] : jobs_) {
    if (job.running()) on_change_(status_of(job));
  }
}

void JobRegistry::set_limit(std::uint32_t limit) {
  const std::lock_guard lock(mutex_);
  limit_ = limit;
}

std::uint32_t JobRegistry::running() const {
  const std::lock_guard lock(mutex_);
  return running_;
}

std::vector<proto::JobStatus> JobRegistry::list() const {
  const std::lock_guard lock(mutex_);
  std::vector<proto::JobStatus> all;
  for (const auto& [id, job] : jobs_) all.push_back(status_of(job));
  return all;
}

void JobRegistry::get(JobId id, double seconds, const SharedTicket& ticket) {
  const std::lock_guard lock(mutex_);
  const Job& job = find(id);
  if (!job.running() || seconds <= 0) {
    ticket->answer(reply_of(job));
    return;
  }
  jobs_[id].waiters.push_back(
      {ticket, call_after(control_, seconds, [this, id, ticket] { late(id, ticket); })});
}

void JobRegistry::late(JobId id, const SharedTicket& ticket) {
  const std::lock_guard lock(mutex_);
  const auto it = jobs_.find(id);
  if (it == jobs_.end()) return;
  ticket->answer(reply_of(it->second));
  std::erase_if(it->second.waiters, [&](const Waiter& waiter) { return waiter.ticket == ticket; });
}

void JobRegistry::abandon(const std::string& client) {
  const std::lock_guard lock(mutex_);
  for (auto& [id, job] : jobs_) {
    std::erase_if(job.waiters, [&](const Waiter& waiter) {
      if (waiter.ticket->client() != client) return false;
      waiter.ticket->abandon();
      return true;
    });
  }
}

void JobRegistry::shut_down(const Refusal& why) {
  std::vector<Waiter> waiters;
  std::vector<Cancel> cancels;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, job] : jobs_) {
      if (!job.running()) continue;
      job.stop_requested = true;
      if (job.cancel) cancels.push_back(job.cancel);
      std::move(job.waiters.begin(), job.waiters.end(), std::back_inserter(waiters));
      job.waiters.clear();
    }
  }
  for (auto& waiter : waiters) waiter.ticket->refuse(why);
  for (auto& cancel : cancels) cancel();
}

}  // namespace limber::server
