#include "engine/session/bodies/recovery.h"
#include "server/kinds/bodies/memory_estimate.h"
#include "server/kinds/bodies/recovery.h"
#include "server/kinds/bodies/scenes.h"
#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {

proto::RecoverResponse Service::recover(const proto::RecoverRequest& request) {
  demand_body(request.scene(), "scene.");
  if (request.scene().base_motion().source_case() == proto::BaseMotion::SOURCE_NOT_SET) {
    throw invalid("scene.base_motion", "the scene has no base motion to recover a material from");
  }
  proto::Scene message = request.scene();
  message.clear_constraints();
  message.clear_keyframes();
  DecodedScene decoded = decode(message);
  proto::RecoverResponse response;
  for (auto& issue : remarks(message, decoded, "scene.")) *response.add_issues() = std::move(issue);
  const session::RecoveryRequest wanted =
      decode_recovery(request).resolved(decoded.scene.frame_count);
  const ServiceLimits& limits = hub_.options.limits;
  if (limits.frames > 0 && request.total_frames() > limits.frames)
    throw limit_exceeded("total_frames", "frames", limits.frames, request.total_frames());
  const std::uint64_t bytes = estimate_recovery_bytes(decoded.scene, wanted.total_frames);
  if (limits.session_bytes > 0 && bytes > limits.session_bytes)
    throw limit_exceeded("scene", "estimated bytes of the recovery", limits.session_bytes, bytes);
  response.set_job(
      start_job("recover", "scene.",
                [wanted, scene = std::move(decoded.scene)](const JobContext& context) mutable {
                  JobProduct product;
                  session::MaterialRecovery recovery = session::recover(scene, wanted, context);
                  product.recovery = encode_report(recovery);
                  product.motion = std::make_shared<const ComputedMotion>(ComputedMotion{
                      std::move(scene), std::move(recovery.geometry), std::move(recovery.positions),
                      recovery.report.frames_per_second});
                  return product;
                }));
  return response;
}

}  // namespace limber::server
