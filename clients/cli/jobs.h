#pragma once

#include <cstdint>
#include <string>

#include "clients/cli/context.h"

namespace limber::cli {

/// Waits for a job and shows how far it is. @returns what came of it
/// @param unnamed  what a stage without a name is called
/// @throws ClientError what the job failed with
v1::GetJobResponse follow_job(Context& context, std::uint64_t job, double wait_s,
                              const std::string& unnamed = "waiting");

/// Waits until a session that was opened is built and solved, and shows how far it is.
/// @throws ClientError what its build failed with
void follow_opening(Context& context, const v1::OpenSessionResponse& opened, double wait_s);

/// Stops a job, also after Ctrl-C; where that fails, stderr says so.
void cancel_quietly(const Context& context, std::uint64_t job);

}  // namespace limber::cli
