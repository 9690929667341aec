#include "clients/cpp/opening.h"

#include <algorithm>

#include "clients/cpp/session_reference.h"

namespace limber::client {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Milliseconds kSlice{
    5000};  // of waiting on the server, so that one that is gone is noticed

double seconds(Milliseconds time) { return std::chrono::duration<double>(time).count(); }

void wait_built(Client& client, std::uint64_t job, Milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    const Milliseconds slice = std::clamp(left, Milliseconds{0}, kSlice);
    v1::GetJobRequest request;
    request.set_job(job);
    request.set_wait_s(seconds(slice));
    const v1::JobStatus status = client.call(request, slice + client.options().timeout).status();
    if (status.state() == v1::JOB_STATE_DONE) return;
    if (status.has_error()) throw ClientError(status.error());
    if (status.state() != v1::JOB_STATE_RUNNING)
      throw ClientError(v1::ERROR_CODE_CANCELLED, "", "opening the session was cancelled");
    if (left <= Milliseconds{0})
      throw ClientError(v1::ERROR_CODE_TIMEOUT, "", "the session is still being built");
  }
}

v1::ResultInfo wait_until(Client& client, const std::string& session, std::uint64_t revision,
                          v1::WaitRequest::Until until, Milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  v1::WaitRequest request;
  request.set_session(session);
  request.set_revision(revision);
  request.set_until(until);
  for (;;) {
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    const Milliseconds slice = std::clamp(left, Milliseconds{1}, kSlice);
    request.set_timeout_s(seconds(slice));
    try {
      return client.call(request, slice + client.options().timeout).result();
    } catch (const Unreachable&) {
      throw;
    } catch (const ClientError& error) {
      if (error.code() != v1::ERROR_CODE_TIMEOUT || left <= kSlice) throw;
    }
  }
}

}  // namespace

Milliseconds large(const Client& client) { return std::max(client.options().timeout, kLarge); }

std::string open_session(Client& client, const v1::Scene& scene, const std::string& session,
                         Milliseconds timeout) {
  v1::OpenSessionRequest request;
  *request.mutable_scene() = scene;
  request.set_session(session);
  const auto opened = client.call(request, large(client));
  std::string reference = session_reference(opened.session(), opened.uid());
  try {
    wait_built(client, opened.job(), timeout);
  } catch (...) {
    try {
      v1::CloseSessionRequest close;
      close.set_session(reference);
      client.call(close, large(client));
    } catch (const ClientError&) {  // why it was not built matters more
    }
    throw;
  }
  return reference;
}

v1::ResultInfo wait_final(Client& client, const std::string& session, std::uint64_t revision,
                          Milliseconds timeout) {
  return wait_until(client, session, revision, v1::WaitRequest::UNTIL_FINAL, timeout);
}

v1::ResultInfo wait_checked(Client& client, const std::string& session, std::uint64_t revision,
                            Milliseconds timeout) {
  return wait_until(client, session, revision, v1::WaitRequest::UNTIL_CHECKED, timeout);
}

}  // namespace limber::client
