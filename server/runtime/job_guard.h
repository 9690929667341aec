#pragma once

#include <exception>
#include <utility>

#include "server/runtime/job_registry.h"
#include "server/wire/errors.h"

namespace limber::server {

/// Ends a job that its session never took over.
class JobGuard {
 public:
  JobGuard(JobRegistry& jobs, JobId job) : jobs_(jobs), job_(job) {}
  ~JobGuard() {
    if (job_ != 0) jobs_.cancelled(job_);
  }
  JobGuard(const JobGuard&) = delete;
  JobGuard& operator=(const JobGuard&) = delete;
  void fail(const std::exception& fault) {
    jobs_.failed(std::exchange(job_, 0), error_to_proto(fault));
  }
  void release() { job_ = 0; }

 private:
  JobRegistry& jobs_;
  JobId job_;
};

}  // namespace limber::server
