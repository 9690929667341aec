#include "server/runtime/hub.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <thread>

#include "server/runtime/stream_message.h"

namespace limber::server {
namespace {

ServerOptions validated(ServerOptions options) {
  options.validate();
  return options;
}

/// As many as may build at once, and some that solve meanwhile: an edit must not wait for a build.
std::size_t session_threads(const ServerOptions& options) {
  if (options.session_threads > 0) return static_cast<std::size_t>(options.session_threads);
  return options.limits.jobs + std::max<std::size_t>(2, std::thread::hardware_concurrency());
}

}  // namespace

Hub::Hub(ServerOptions given)
    : options(validated(std::move(given))),
      transport(options.transport, counters),
      jobs(
          control, options.limits.jobs,
          [this](const proto::JobStatus& status) { publish_job(status); }, run.first_id),
      store(options.store ? std::make_unique<store::Store>(*options.store) : nullptr),
      session_pool(session_threads(options)),
      request_pool(static_cast<std::size_t>(options.request_threads)) {}

session::Executor Hub::session_executor() {
  return [this](std::function<void()> task) { boost::asio::post(session_pool, std::move(task)); };
}

void Hub::publish_job(const proto::JobStatus& status) {
  if (!transport.has_subscriber(kJobsTopic)) return;
  auto message = stream_message(run, status.session(), 0);
  *message.mutable_job() = status;
  transport.publish(kJobsTopic, {message.SerializeAsString()});
}

}  // namespace limber::server
