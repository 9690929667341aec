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

/// Stops a job, also after Ctrl-C; where that fails, stderr says so.
void cancel_quietly(const Context& context, std::uint64_t job);

}  // namespace limber::cli
