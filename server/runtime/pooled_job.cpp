#include "server/runtime/pooled_job.h"

#include <utility>

#include "server/wire/errors.h"

namespace limber::server {

JobId start_pooled_job(Hub& hub, const char* kind, const char* prefix,
                       std::function<JobProduct(const JobContext&)> work) {
  const Cancellation cancellation;
  const JobId job = hub.jobs.start(kind, "", [cancellation] { cancellation.request(); });
  // All clients together have --max-jobs of them, in any distribution.
  hub.post_job([&hub, job, prefix, cancellation, work = std::move(work)] {
    const JobContext context{cancellation, [&hub, job](const std::string& stage, double fraction) {
                               hub.jobs.progress(job, {stage, fraction});
                             }};
    try {
      hub.jobs.done(job, work(context));
    } catch (const std::exception& fault) {
      const auto* error = dynamic_cast<const Error*>(&fault);
      if (error != nullptr && error->code() == ErrorCode::kCancelled)
        return hub.jobs.cancelled(job);
      hub.jobs.failed(job, error_to_proto(fault, prefix));
    }
  });
  return job;
}

}  // namespace limber::server
