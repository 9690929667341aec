#pragma once

#include <cstdint>

#include "clients/cli/context.h"

namespace limber::cli {

/// Waits for a job and shows how far it is. @throws ClientError what the job failed with
void follow_job(Context& context, std::uint64_t job, double wait_s);

}  // namespace limber::cli
