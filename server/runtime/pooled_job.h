#pragma once

#include <functional>

#include "engine/base/job.h"
#include "server/runtime/hub.h"

namespace limber::server {

/// A job of its own on the session pool, cancelled and reported like all jobs.
/// @param prefix  before the fields of errors, which are the work's own; a literal
JobId start_pooled_job(Hub& hub, const char* kind, const char* prefix,
                       std::function<JobProduct(const JobContext&)> work);

}  // namespace limber::server
