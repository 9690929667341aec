#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>

#include "engine/session/simulation.h"
#include "server/codec/errors.h"
#include "server/codec/frames.h"
#include "server/service/export.h"
#include "server/service/memory_estimate.h"
#include "server/service/scene_files.h"
#include "server/service/service.h"

namespace limber::server {
namespace {

/// Bytes of `count` frames as float32.
std::uint64_t positions_bytes(const session::SimulatedMotion& motion, int count) {
  return static_cast<std::uint64_t>(motion.positions.rows()) * sizeof(float) *
         static_cast<std::uint64_t>(count);
}

proto::Frames encode_positions(const session::SimulatedMotion& motion, FrameRange range) {
  proto::Frames frames;
  frames.set_encoding(proto::ENCODING_POSITIONS);
  frames.set_first_frame(static_cast<std::uint32_t>(range.first));
  frames.set_frame_count(static_cast<std::uint32_t>(range.count));
  auto* data = frames.mutable_data();
  data->set_type(proto::DATA_TYPE_FLOAT32);
  data->add_shape(static_cast<std::uint64_t>(range.count));
  data->add_shape(static_cast<std::uint64_t>(motion.positions.rows() / 3));
  data->add_shape(3);
  if (range.count > 0)
    data->set_data(motion.positions.col(range.first).data(), positions_bytes(motion, range.count));
  return frames;
}

}  // namespace

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
    product.simulation =
        std::make_shared<const SimulatedScene>(SimulatedScene{std::move(scene), std::move(motion)});
    hub_.jobs.done(job, std::move(product));
  } catch (const std::exception& fault) {
    const auto* error = dynamic_cast<const Error*>(&fault);
    if (error != nullptr && error->code() == ErrorCode::kCancelled) return hub_.jobs.cancelled(job);
    hub_.jobs.failed(job, error_to_proto(fault, "scene."));
  }
}

proto::GetFramesResponse Service::get_simulated_frames(
    const proto::GetFramesRequest& request) const {
  if (!request.session().empty()) throw invalid("job", "give either a session or a job");
  if (request.encoding() != proto::ENCODING_UNSPECIFIED &&
      request.encoding() != proto::ENCODING_POSITIONS) {
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "encoding",
                  "frames of a simulation come as ENCODING_POSITIONS");
  }
  if (request.final_only()) throw invalid("final_only", "a simulation has one motion");
  const auto simulated = hub_.jobs.simulation(request.job());
  const FrameRange range = frame_range(request.first_frame(), request.frame_count(),
                                       static_cast<int>(simulated->motion.positions.cols()));
  const std::uint64_t bytes = positions_bytes(simulated->motion, range.count);
  if (bytes > hub_.options.transport.message_bytes) {
    throw limit_exceeded("frame_count", "bytes of the frames (ask for fewer at a time)",
                         hub_.options.transport.message_bytes, bytes);
  }
  proto::GetFramesResponse response;
  *response.mutable_frames() = encode_positions(simulated->motion, range);
  return response;
}

proto::ExportResponse Service::export_simulated(const proto::ExportRequest& request) const {
  if (!request.session().empty()) throw invalid("job", "give either a session or a job");
  if (request.format() == proto::EXPORT_FORMAT_UNSPECIFIED) throw invalid("format", "unspecified");
  return export_simulation(hub_.jobs.simulation(request.job()), request.format(),
                           checked_stem(request.stem()), request.part());
}

}  // namespace limber::server
