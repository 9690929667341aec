#include "server/kinds/bodies/requests.h"

#include "engine/scene/formats/surface_formats.h"
#include "engine/scene/tetrahedralize/tetrahedralize.h"
#include "engine/session/bodies/recovery.h"
#include "engine/session/bodies/simulation.h"
#include "server/kinds/bodies/export.h"
#include "server/kinds/bodies/limits.h"
#include "server/kinds/bodies/memory_estimate.h"
#include "server/kinds/bodies/recovery.h"
#include "server/kinds/bodies/scene_readers.h"
#include "server/kinds/bodies/scenes.h"
#include "server/kinds/bodies/simulation.h"
#include "server/kinds/bodies/tetrahedralization.h"
#include "server/runtime/pooled_job.h"
#include "server/wire/errors.h"
#include "server/wire/fields.h"
#include "server/wire/indices.h"
#include "server/wire/issues.h"

namespace limber::server {
namespace {

scene::TriangleSurface read_closed_surface(const proto::MeshFile& file) {
  return read_at("surface", [&] {
    return scene::closed_outward(scene::read_surface(file.name(), file.content()));
  });
}

proto::TetrahedralizeResponse tetrahedralize(const proto::TetrahedralizeRequest& request,
                                             Hub& hub) {
  scene::TetrahedralizeOptions options;
  if (request.has_target_tets()) {
    if (request.target_tets() > hub.options.limits.mesh_tets) {
      throw limit_exceeded("target_tets", "tets", hub.options.limits.mesh_tets,
                           request.target_tets());
    }
    options.target_tets = decode_index(request.target_tets(), "target_tets");
  }
  if (request.has_within()) options.within = request.within();
  options.validate();
  auto surface = read_closed_surface(request.surface());
  proto::TetrahedralizeResponse response;
  response.set_job(start_pooled_job(
      hub, "tetrahedralize", "", [options, surface = std::move(surface)](const JobContext& job) {
        const auto result = scene::tetrahedralize(surface, options, job);
        JobProduct product;
        product.mesh = encode_mesh(result.mesh);
        product.tetrahedralization = encode_report(result);
        for (const auto& text : result.notes)
          product.issues.push_back(encode_warning("surface", text));
        return product;
      }));
  return response;
}

proto::SimulateResponse simulate(const proto::SimulateRequest& request, Hub& hub,
                                 const SceneContext& context) {
  demand_body(request.scene(), "scene.");
  proto::Scene message = request.scene();
  if (!message.has_simulation()) {
    throw invalid("scene.simulation",
                  "the scene says nothing to simulate: loads or an initial state are expected");
  }
  leave_simulation(message);
  DecodedScene decoded = decode_body(message, "scene.", context);
  proto::SimulateResponse response;
  for (auto& issue : remarks(message, decoded, "scene.")) *response.add_issues() = std::move(issue);
  const std::uint64_t bytes = estimate_simulation_bytes(decoded.scene);
  const std::uint64_t limit = context.limits.session_bytes;
  if (limit > 0 && bytes > limit)
    throw limit_exceeded("scene", "estimated bytes of the simulation", limit, bytes);
  response.set_job(start_pooled_job(
      hub, "simulate", "scene.", [scene = std::move(decoded.scene)](const JobContext& job) mutable {
        JobProduct product;
        session::SimulatedMotion motion = session::simulate(scene, job);
        product.simulation = encode_report(motion);
        product.motion = job_motion(ComputedMotion{std::move(scene), std::move(motion.geometry),
                                                   std::move(motion.positions),
                                                   motion.report.frames_per_second});
        return product;
      }));
  return response;
}

proto::RecoverResponse recover(const proto::RecoverRequest& request, Hub& hub,
                               const SceneContext& context) {
  demand_body(request.scene(), "scene.");
  if (request.scene().base_motion().source_case() == proto::BaseMotion::SOURCE_NOT_SET) {
    throw invalid("scene.base_motion", "the scene has no base motion to recover a material from");
  }
  proto::Scene message = request.scene();
  message.clear_constraints();
  message.clear_keyframes();
  DecodedScene decoded = decode_body(message, "scene.", context);
  proto::RecoverResponse response;
  for (auto& issue : remarks(message, decoded, "scene.")) *response.add_issues() = std::move(issue);
  const session::RecoveryRequest recovery_request =
      decode_recovery(request).resolved(decoded.scene.frame_count);
  const ServiceLimits& limits = context.limits;
  if (limits.frames > 0 && request.total_frames() > limits.frames)
    throw limit_exceeded("total_frames", "frames", limits.frames, request.total_frames());
  const std::uint64_t bytes = estimate_recovery_bytes(decoded.scene, recovery_request.total_frames);
  if (limits.session_bytes > 0 && bytes > limits.session_bytes)
    throw limit_exceeded("scene", "estimated bytes of the recovery", limits.session_bytes, bytes);
  response.set_job(start_pooled_job(
      hub, "recover", "scene.",
      [recovery_request, scene = std::move(decoded.scene)](const JobContext& job) mutable {
        JobProduct product;
        session::MaterialRecovery recovery = session::recover(scene, recovery_request, job);
        product.recovery = encode_report(recovery);
        product.motion = job_motion(ComputedMotion{std::move(scene), std::move(recovery.geometry),
                                                   std::move(recovery.positions),
                                                   recovery.report.frames_per_second});
        return product;
      }));
  return response;
}

}  // namespace

DecodedScene decode_body(const proto::Scene& message, const std::string& prefix,
                         const SceneContext& context) {
  return decode_scene(message, prefix, scene_limits(context.limits),
                      scene_readers(context.resolve, mesh_read_limits(context.limits)));
}

bool answer_body_request(const proto::Request& request, proto::Reply& reply, Hub& hub,
                         const SceneContext& context) {
  switch (request.body_case()) {
    case proto::Request::kTetrahedralize:
      *reply.mutable_tetrahedralize() = tetrahedralize(request.tetrahedralize(), hub);
      return true;
    case proto::Request::kSimulate:
      *reply.mutable_simulate() = simulate(request.simulate(), hub, context);
      return true;
    case proto::Request::kRecover:
      *reply.mutable_recover() = recover(request.recover(), hub, context);
      return true;
    default:
      return false;
  }
}

}  // namespace limber::server
