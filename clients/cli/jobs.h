#pragma once

#include <cstdint>
#include <string>

#include "clients/cli/context.h"

namespace limber::cli {

/// Waits for a job and shows its progress. @returns its result
/// @param unnamed  title of a stage without a name
/// @throws ClientError of the job's failure
v1::GetJobResponse follow_job(Context& context, std::uint64_t job, double wait_s,
                              const std::string& unnamed = "waiting");

/// Waits until a session that was opened is built and solved, and shows how far it is.
/// @throws ClientError of its build's failure
void follow_opening(Context& context, const v1::OpenSessionResponse& opened, double wait_s);

/// Stops a job, also after Ctrl-C; where that fails, stderr says so.
void cancel_quietly(const Context& context, std::uint64_t job);

}  // namespace limber::cli
