#include "engine/session/bodies/simulation.h"

#include "server/kinds/bodies/memory_estimate.h"
#include "server/kinds/bodies/scenes.h"
#include "server/kinds/bodies/simulation.h"
#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {
proto::SimulateResponse Service::simulate(const proto::SimulateRequest& request) {
  demand_body(request.scene(), "scene.");
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
  response.set_job(start_job(
      "simulate", "scene.", [scene = std::move(decoded.scene)](const JobContext& context) mutable {
        JobProduct product;
        session::SimulatedMotion motion = session::simulate(scene, context);
        product.simulation = encode_report(motion);
        product.motion = std::make_shared<const ComputedMotion>(
            ComputedMotion{std::move(scene), std::move(motion.geometry),
                           std::move(motion.positions), motion.report.frames_per_second});
        return product;
      }));
  return response;
}

}  // namespace limber::server
