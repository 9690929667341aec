#include "clients/cpp/opening.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "clients/cpp/session_reference.h"

namespace limber::client {
namespace {

using Clock = std::chrono::steady_clock;

/// The server holds an answer back for so long at a time, so that one that is gone is noticed.
constexpr Milliseconds kHoldTime{1000};
/// After this long a silence it is asked whether it is there, which it answers at once however busy
/// it is. With the slice, a server that is gone is noticed within 8 s.
constexpr Milliseconds kSilence{3500}, kPatience{3000};

double seconds(Milliseconds time) { return std::chrono::duration<double>(time).count(); }

/// The answer to a request that the server holds back for `slice`; nothing where it is there but
/// has not answered. @throws Unreachable, and what is refused
template <class Request>
std::optional<typename Rpc<Request>::Response> held_answer(Client& client, const Request& request,
                                                           Milliseconds slice) {
  const Milliseconds most = client.options().timeout;
  try {
    return client.collect<Request>(client.submit(request), slice + std::min(kSilence, most));
  } catch (const ServerStopped&) {
    throw;
  } catch (const Unreachable&) {
  }
  try {
    (void)greet(client, std::min(kPatience, most));
  } catch (const ServerStopped&) {
    throw;
  } catch (const Unreachable&) {
    throw Unreachable("limberd at " + client.endpoint() +
                      " has ended or hangs: it does not answer");
  }
  return std::nullopt;
}

void wait_built(Client& client, std::uint64_t job, Milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    const Milliseconds slice = std::clamp(left, Milliseconds{0}, kHoldTime);
    v1::GetJobRequest request;
    request.set_job(job);
    request.set_wait_s(seconds(slice));
    if (const auto answer = held_answer(client, request, slice)) {
      const v1::JobStatus& status = answer->status();
      if (status.state() == v1::JOB_STATE_DONE) return;
      if (status.has_error()) throw ClientError(status.error());
      if (status.state() != v1::JOB_STATE_RUNNING)
        throw ClientError(v1::ERROR_CODE_CANCELLED, "", "opening the session was cancelled");
    }
    if (left <= Milliseconds{0})
      throw ClientError(v1::ERROR_CODE_TIMEOUT, "", "the session is still being built");
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

v1::ResultInfo wait_for_result(Client& client, v1::WaitRequest request, Milliseconds timeout,
                               const WaitProgress& progress) {
  constexpr Milliseconds kToProgress{400};
  const Milliseconds stretch = progress ? kToProgress : kHoldTime;
  v1::GetSessionRequest look;
  look.set_session(request.session());
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    const Milliseconds slice = std::clamp(left, Milliseconds{1}, stretch);
    request.set_timeout_s(seconds(slice));
    try {
      if (auto answer = held_answer(client, request, slice))
        return std::move(*answer->mutable_result());
    } catch (const Unreachable&) {
      throw;
    } catch (const ClientError& error) {
      if (error.code() != v1::ERROR_CODE_TIMEOUT) throw;
    }
    if (progress) {
      if (const auto answer = held_answer(client, look, Milliseconds{0}))
        progress(answer->status());
    }
    if (Clock::now() >= deadline) {
      throw ClientError(v1::ERROR_CODE_TIMEOUT, "timeout_s",
                        fmt::format("no such result within {} s", seconds(timeout)));
    }
  }
}

namespace {

v1::WaitRequest wait_request(const std::string& session, std::uint64_t revision,
                             v1::WaitRequest::Until until) {
  v1::WaitRequest request;
  request.set_session(session);
  request.set_revision(revision);
  request.set_until(until);
  return request;
}

}  // namespace

v1::ResultInfo wait_final(Client& client, const std::string& session, std::uint64_t revision,
                          Milliseconds timeout) {
  return wait_for_result(client, wait_request(session, revision, v1::WaitRequest::UNTIL_FINAL),
                         timeout, {});
}

v1::ResultInfo wait_checked(Client& client, const std::string& session, std::uint64_t revision,
                            Milliseconds timeout) {
  return wait_for_result(client, wait_request(session, revision, v1::WaitRequest::UNTIL_CHECKED),
                         timeout, {});
}

}  // namespace limber::client
