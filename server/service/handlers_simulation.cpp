#include "engine/session/simulation.h"

#include <boost/asio/post.hpp>

#include "server/codec/errors.h"
#include "server/codec/simulation.h"
#include "server/service/memory_estimate.h"
#include "server/service/scene_files.h"
#include "server/service/service.h"

namespace limber::server {
proto::SimulateResponse Service::simulate(const proto::SimulateRequest& request) {
  proto::Scene message = request.scene();
  if (!message.has_simulation()) {
    throw invalid("scene.simulation",
                  "the scene says nothing to simulate: loads or an initial state are expected");
  }
  message.clear_base_motion();
  DecodedScene decoded = decode(message);
  proto::SimulateResponse response;
  for (auto& issue : remarks(message, decoded, "scene.")) *response.add_issues() = std::move(issue);
  const std::uint64_t bytes = estimate_simulation_bytes(decoded.scene);
  const std::uint64_t limit = hub_.options.limits.session_bytes;
  if (limit > 0 && bytes > limit)
    throw limit_exceeded("scene", "estimated bytes of the simulation", limit, bytes);
  const Cancellation cancellation;
  const JobId job = hub_.jobs.start("simulate", "", [cancellation] { cancellation.request(); });
  JobContext context{cancellation, [this, job](const std::string& stage, double fraction) {
                       hub_.jobs.progress(job, {stage, fraction});
                     }};
  boost::asio::post(hub_.session_pool, [this, job, context = std::move(context),
                                        scene = std::move(decoded.scene)]() mutable {
    run_simulation(job, context, std::move(scene));
  });
  response.set_job(job);
  return response;
}

void Service::run_simulation(JobId job, const JobContext& context, scene::Scene scene) {
  try {
    JobProduct product;
    session::SimulatedMotion motion = session::simulate(scene, context);
    product.simulation = encode_report(motion);
    product.motion = std::make_shared<const ComputedMotion>(
        ComputedMotion{std::move(scene), std::move(motion.geometry), std::move(motion.positions),
                       motion.report.frames_per_second});
    hub_.jobs.done(job, std::move(product));
  } catch (const std::exception& fault) {
    const auto* error = dynamic_cast<const Error*>(&fault);
    if (error != nullptr && error->code() == ErrorCode::kCancelled) return hub_.jobs.cancelled(job);
    hub_.jobs.failed(job, error_to_proto(fault, "scene."));
  }
}

}  // namespace limber::server
