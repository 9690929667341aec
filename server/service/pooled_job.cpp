#include <boost/asio/post.hpp>
#include <utility>

#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {

JobId Service::start_job(const char* kind, const char* prefix,
                         std::function<JobProduct(const JobContext&)> work) {
  const Cancellation cancellation;
  const JobId job = hub_.jobs.start(kind, "", [cancellation] { cancellation.request(); });
  boost::asio::post(hub_.session_pool, [this, job, prefix, cancellation, work = std::move(work)] {
    const JobContext context{cancellation, [this, job](const std::string& stage, double fraction) {
                               hub_.jobs.progress(job, {stage, fraction});
                             }};
    try {
      hub_.jobs.done(job, work(context));
    } catch (const std::exception& fault) {
      const auto* error = dynamic_cast<const Error*>(&fault);
      if (error != nullptr && error->code() == ErrorCode::kCancelled)
        return hub_.jobs.cancelled(job);
      hub_.jobs.failed(job, error_to_proto(fault, prefix));
    }
  });
  return job;
}

}  // namespace limber::server
