#include "clients/cpp/linkages/design.h"

#include <algorithm>
#include <utility>

namespace limber::client {

LinkageDesign::LinkageDesign(Client& client, std::string session, Naming naming)
    : client_(&client), session_(client, std::move(session), naming) {}

std::uint64_t LinkageDesign::start(v1::StartDesignRequest request) {
  request.set_session(session_.get(*client_));
  return client_->call(request, kLarge).job();
}

v1::ChangeDesignResponse LinkageDesign::change(v1::ChangeDesignRequest request) {
  request.set_session(session_.get(*client_));
  return client_->call(request, kLarge);
}

template <class Request>
typename Rpc<Request>::Response LinkageDesign::act() {
  Request request;
  request.set_session(session_.get(*client_));
  return client_->call(request);
}

v1::PauseDesignResponse LinkageDesign::pause() { return act<v1::PauseDesignRequest>(); }
v1::ResumeDesignResponse LinkageDesign::resume() { return act<v1::ResumeDesignRequest>(); }
v1::StopDesignResponse LinkageDesign::stop(Milliseconds timeout) {
  const v1::StopDesignResponse response = act<v1::StopDesignRequest>();
  wait_until_ended(timeout);
  return response;
}

std::uint64_t LinkageDesign::take(std::optional<std::uint64_t> expected_revision,
                                  Milliseconds timeout) {
  v1::TakeDesignRequest request;
  request.set_session(session_.get(*client_));
  if (expected_revision) request.set_expected_revision(*expected_revision);
  const std::uint64_t revision = client_->call(request).revision();
  wait_until_ended(timeout);
  return revision;
}

v1::GetDesignResponse LinkageDesign::newest() { return act<v1::GetDesignRequest>(); }

std::optional<v1::DesignInfo> LinkageDesign::info() {
  const v1::GetDesignResponse response = newest();
  if (!response.has_design()) return std::nullopt;
  return response.design();
}

std::vector<double> LinkageDesign::best_lengths() {
  const v1::GetDesignResponse response = newest();
  return {response.best_lengths().begin(), response.best_lengths().end()};
}

v1::DesignInfo LinkageDesign::wait(Milliseconds timeout) {
  v1::DesignInfo info = wait_until_ended(timeout);
  if (info.has_error()) throw ClientError(info.error());
  return info;
}

v1::DesignInfo LinkageDesign::wait_until_ended(Milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  constexpr Milliseconds kStretch{500};
  const auto deadline = Clock::now() + timeout;
  while (true) {
    const std::optional<v1::DesignInfo> now = info();
    if (!now) {
      throw ClientError(v1::ERROR_CODE_FAILED_PRECONDITION, "session",
                        "session " + session_.name() + " has no design");
    }
    if (now->state() == v1::DESIGN_STATE_ENDED) return *now;
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) {
      throw ClientError(v1::ERROR_CODE_TIMEOUT, "",
                        "the design goes on after " + std::to_string(timeout.count()) + " ms");
    }
    v1::GetJobRequest job;
    job.set_job(now->job());
    job.set_wait_s(std::chrono::duration<double>(std::min(kStretch, left)).count());
    (void)client_->call(job, kStretch + client_->options().timeout);
  }
}

}  // namespace limber::client
