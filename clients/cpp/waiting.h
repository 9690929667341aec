#pragma once

#include <cstdint>
#include <functional>

#include "clients/cpp/client.h"

namespace limber::client {

/// How long another run of limberd is awaited that is to follow one that ended in order.
inline constexpr Milliseconds kNextRun{60000};

/// How a session, or a job, is while it is waited for.
using WaitProgress = std::function<void(const v1::SessionStatus&)>;
using JobProgress = std::function<void(const v1::JobStatus&)>;

/// Answer to a wait on a session. @param request  its timeout is put in
/// @param progress  called about twice a second while there is no answer; may be empty
/// @throws ClientError TIMEOUT; Unreachable within 8 s of when the server falls silent
[[nodiscard]] v1::ResultInfo wait_for_result(Client& client, v1::WaitRequest request,
                                             Milliseconds timeout, const WaitProgress& progress);

/// Until a session that was opened is built and solved. If its job ends with the run of limberd,
/// the next one brings the session back, if it is stored, and builds it.
/// @param opened  as begin_session() returns it. @param progress  as of wait_job()
/// @throws ClientError as wait_job()
void wait_until_ready(Client& client, const v1::OpenSessionResponse& opened,
                      const JobProgress& progress, Milliseconds timeout);

/// Waits until a job is done. @returns its result
/// @param progress  called about five times a second, and for the job that is done; may be empty
/// @throws ClientError of the job's failure; CANCELLED; TIMEOUT; Unreachable within 8 s after the
/// server falls silent
[[nodiscard]] v1::GetJobResponse wait_job(Client& client, std::uint64_t job,
                                          const JobProgress& progress, Milliseconds timeout);

}  // namespace limber::client
