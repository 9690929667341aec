#include "server/service/hub.h"

#include <algorithm>
#include <thread>

#include "limber/v1/stream.pb.h"

namespace limber::server {
namespace {

ServerOptions validated(ServerOptions options) {
  options.validate();
  return options;
}

std::size_t session_threads(int wanted) {
  if (wanted > 0) return static_cast<std::size_t>(wanted);
  return std::max<std::size_t>(4, 2 * std::thread::hardware_concurrency());
}

}  // namespace

Hub::Hub(ServerOptions given)
    : options(validated(std::move(given))),
      transport(options.transport, counters),
      jobs(control, options.limits.jobs,
           [this](const proto::JobStatus& status) { publish_job(status); }),
      cache(std::make_shared<session::ModelCache>(options.cache_folder)),
      session_pool(session_threads(options.session_threads)),
      request_pool(static_cast<std::size_t>(options.request_threads)) {}

void Hub::publish_job(const proto::JobStatus& status) {
  if (!transport.wanted(kJobsTopic)) return;
  proto::StreamMessage message;
  message.set_version(1);
  message.set_session(status.session());
  *message.mutable_job() = status;
  transport.publish(kJobsTopic, {message.SerializeAsString()});
}

}  // namespace limber::server
