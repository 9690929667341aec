#include "clients/cli/jobs.h"

#include <fmt/format.h>

#include "clients/cli/print.h"
#include "clients/cpp/server.h"
#include "clients/cpp/waiting.h"

namespace limber::cli {

namespace {

client::JobProgress shown_by(ProgressBar& bar, const std::string& unnamed) {
  return [&bar, unnamed](const v1::JobStatus& status) {
    const v1::Progress& progress = status.progress();
    bar.show(progress.stage().empty() ? unnamed : progress.stage(),
             status.state() == v1::JOB_STATE_DONE ? 1 : progress.fraction());
  };
}

}  // namespace

v1::GetJobResponse follow_job(Context& context, std::uint64_t job, double wait_s,
                              const std::string& unnamed) {
  ProgressBar bar;
  return client::wait_job(context.client(), job, shown_by(bar, unnamed), milliseconds(wait_s));
}

void follow_opening(Context& context, const v1::OpenSessionResponse& opened, double wait_s) {
  ProgressBar bar;
  client::wait_until_ready(context.client(), opened, shown_by(bar, "opening"),
                           milliseconds(wait_s));
}

void cancel_quietly(const Context& context, std::uint64_t job) {
  try {
    client::Client client(context.endpoint, context.closing_options());
    client::cancel_job(client, job);
  } catch (const client::ClientError& error) {
    fmt::print(stderr, "limber: job {} could not be cancelled: {}\n", job, error.what());
  }
}

}  // namespace limber::cli
