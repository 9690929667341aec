#include "clients/cli/jobs.h"

#include <fmt/format.h>

#include <chrono>
#include <string>

#include "clients/cli/print.h"

namespace limber::cli {

void follow_job(Context& context, std::uint64_t job, double wait_s) {
  ProgressBar bar;
  const auto deadline = std::chrono::steady_clock::now() + milliseconds(wait_s);
  while (true) {
    v1::GetJobRequest request;
    request.set_job(job);
    request.set_wait_s(0.2);
    const auto status = context.client().call(request).status();
    const std::string stage =
        status.progress().stage().empty() ? "waiting" : status.progress().stage();
    if (status.state() == v1::JOB_STATE_DONE) return bar.show(stage, 1);
    if (status.state() == v1::JOB_STATE_FAILED || status.state() == v1::JOB_STATE_CANCELLED) {
      if (status.has_error()) throw client::ClientError(status.error());
      throw client::ClientError(v1::ERROR_CODE_CANCELLED, "",
                                fmt::format("job {} ended without a result", job));
    }
    bar.show(stage, status.progress().fraction());
    if (std::chrono::steady_clock::now() > deadline)
      throw client::ClientError(v1::ERROR_CODE_TIMEOUT, "",
                                fmt::format("job {} still runs after {} s", job, wait_s));
  }
}

}  // namespace limber::cli
