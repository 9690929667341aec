#pragma once

#include <cstdint>
#include <functional>

#include "clients/cpp/client.h"

namespace limber::client {

/// How a session, or a job, is while it is waited for.
using WaitProgress = std::function<void(const v1::SessionStatus&)>;
using JobProgress = std::function<void(const v1::JobStatus&)>;

/// What a wait on a session is answered with. @param request  its timeout is put in
/// @param progress  told about twice a second while there is no answer; may be empty
/// @throws ClientError TIMEOUT; Unreachable within 8 s of when the server falls silent
[[nodiscard]] v1::ResultInfo wait_for_result(Client& client, v1::WaitRequest request,
                                             Milliseconds timeout, const WaitProgress& progress);

/// Until a job is done. @returns what came of it
/// @param progress  told about five times a second, and of the job that is done; may be empty
/// @throws ClientError what the job failed with; CANCELLED; TIMEOUT; Unreachable within 8 s of when
/// the server falls silent
[[nodiscard]] v1::GetJobResponse wait_job(Client& client, std::uint64_t job,
                                          const JobProgress& progress, Milliseconds timeout);

}  // namespace limber::client
