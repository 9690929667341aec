#include "clients/cpp/waiting.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <thread>
#include <utility>

#include "clients/cpp/session_reference.h"

namespace limber::client {
namespace {

using Clock = std::chrono::steady_clock;

/// The server holds an answer back for so long at a time, so that a dead server is noticed.
constexpr Milliseconds kHoldTime{1000};
/// After this long a silence it is asked whether it is there, which it answers at once however busy
/// it is. With the slice, a dead server is noticed within 8 s.
constexpr Milliseconds kSilence{3500}, kPatience{3000};
/// The result of a job may be many megabytes: after each silence it gets twice the time, to this.
constexpr Milliseconds kLongestSilence{120000};

/// Between requests to a server that has said that it ends.
constexpr Milliseconds kPause{100};

double seconds(Milliseconds time) { return std::chrono::duration<double>(time).count(); }

Milliseconds first_silence(const Client& client) {
  return std::min(kSilence, client.options().timeout);
}

/// The answer to a request that the server holds back for `slice`; nothing if it is there but has
/// not answered within `silence` more. @throws Unreachable, and refusals of the server
template <class Request>
std::optional<typename Rpc<Request>::Response> held_answer(Client& client, const Request& request,
                                                           Milliseconds slice,
                                                           Milliseconds silence) {
  try {
    return client.collect<Request>(client.submit(request), slice + silence);
  } catch (const ServerStopped&) {
    throw;
  } catch (const Unreachable&) {
  }
  try {
    (void)greet(client, std::min(kPatience, client.options().timeout));
  } catch (const ServerStopped&) {
    throw;
  } catch (const Unreachable&) {
    throw Unreachable("limberd at " + client.endpoint() +
                      " has ended or hangs: it does not answer");
  }
  return std::nullopt;
}

/// @param put_off  by a run that another one follows, which is awaited
v1::ResultInfo wait_over_runs(Client& client, v1::WaitRequest request, Milliseconds timeout,
                              const WaitProgress& progress, std::optional<ServerStopped> put_off) {
  constexpr Milliseconds kToProgress{400};
  const Milliseconds stretch = progress ? kToProgress : kHoldTime;
  const Milliseconds silence = first_silence(client);
  v1::GetSessionRequest look;
  look.set_session(request.session());
  const auto ask = [&](Milliseconds slice) -> std::optional<v1::ResultInfo> {
    request.set_timeout_s(seconds(slice));
    try {
      if (auto answer = held_answer(client, request, slice, silence))
        return std::move(*answer->mutable_result());
    } catch (const Unreachable&) {
      throw;
    } catch (const ClientError& error) {
      if (error.code() != v1::ERROR_CODE_TIMEOUT) throw;
    }
    if (progress) {
      if (const auto answer = held_answer(client, look, Milliseconds{0}, silence))
        progress(answer->status());
    }
    return std::nullopt;
  };
  auto deadline = Clock::now() + timeout;
  for (;;) {
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    try {
      if (auto result = ask(std::clamp(left, Milliseconds{1}, stretch))) return std::move(*result);
      put_off.reset();
    } catch (const ServerStopped& refusal) {
      if (!is_for_next_run(refusal)) throw;
      if (!put_off) deadline = std::min(deadline, Clock::now() + kNextRun);
      put_off = refusal;
      std::this_thread::sleep_for(kPause);
    } catch (const Unreachable&) {
      if (!put_off) throw;
    }
    if (Clock::now() >= deadline) {
      if (put_off) throw *put_off;
      throw ClientError(v1::ERROR_CODE_TIMEOUT, "timeout_s",
                        fmt::format("no such result within {} s", seconds(timeout)));
    }
  }
}

}  // namespace

v1::ResultInfo wait_for_result(Client& client, v1::WaitRequest request, Milliseconds timeout,
                               const WaitProgress& progress) {
  return wait_over_runs(client, std::move(request), timeout, progress, {});
}

v1::GetJobResponse wait_job(Client& client, std::uint64_t job, const JobProgress& progress,
                            Milliseconds timeout) {
  constexpr Milliseconds kToProgress{200};
  const Milliseconds stretch = progress ? kToProgress : kHoldTime;
  v1::GetJobRequest request;
  request.set_job(job);
  Milliseconds silence = first_silence(client);
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    const auto left = std::chrono::duration_cast<Milliseconds>(deadline - Clock::now());
    const Milliseconds slice = std::clamp(left, Milliseconds{0}, stretch);
    request.set_wait_s(seconds(slice));
    if (auto answer = held_answer(client, request, slice, silence)) {
      const v1::JobStatus& status = answer->status();
      const bool is_done = status.state() == v1::JOB_STATE_DONE;
      if (!is_done && status.has_error()) throw ClientError(status.error());
      if (!is_done && status.state() != v1::JOB_STATE_RUNNING)
        throw ClientError(v1::ERROR_CODE_CANCELLED, "",
                          fmt::format("job {} ended without a result", job));
      if (progress) progress(status);
      if (is_done) return std::move(*answer);
    } else {
      silence = std::min(2 * silence, kLongestSilence);
    }
    if (left <= Milliseconds{0})
      throw ClientError(v1::ERROR_CODE_TIMEOUT, "",
                        fmt::format("job {} still runs after {} s", job, seconds(timeout)));
  }
}

namespace {

/// For a job that was waited for; another run may have its session.
bool ended_with_its_run(const ClientError& error) {
  const bool is_unknown = error.code() == v1::ERROR_CODE_NOT_FOUND && error.field() == "job";
  return is_for_next_run(error) || is_unknown || error.code() == v1::ERROR_CODE_RESTARTED;
}

WaitProgress as_of_session(const JobProgress& progress) {
  if (!progress) return {};
  return [&progress](const v1::SessionStatus& session) {
    v1::JobStatus status;
    status.set_state(v1::JOB_STATE_RUNNING);
    *status.mutable_progress() = session.progress();
    progress(status);
  };
}

}  // namespace

void wait_until_ready(Client& client, const v1::OpenSessionResponse& opened,
                      const JobProgress& progress, Milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  try {
    (void)wait_job(client, opened.job(), progress, timeout);
    return;
  } catch (const ClientError& end) {
    if (!ended_with_its_run(end)) throw;
    v1::WaitRequest request;
    request.set_session(session_reference(opened.session(), opened.uid()));
    request.set_until(v1::WaitRequest::UNTIL_FINAL);
    const auto left = std::chrono::ceil<Milliseconds>(deadline - Clock::now());
    std::optional<ServerStopped> put_off;
    if (const auto* stopped = dynamic_cast<const ServerStopped*>(&end)) put_off = *stopped;
    try {
      (void)wait_over_runs(client, request, std::max(left, Milliseconds{1}),
                           as_of_session(progress), put_off);
      return;
    } catch (const Unreachable&) {
      if (!put_off) throw;
    }
    throw ServerStopped(
        fmt::format("limberd at {} was stopped while session {} was built, and no other run of it "
                    "answers; the session is stored, and built when one is asked for it",
                    client.endpoint(), opened.session()));
  }
}

}  // namespace limber::client
