// Frames and files, of sessions and of motions that jobs made.
#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {

void Service::demand_message_room(std::uint64_t frame_bytes) const {
  if (frame_bytes > hub_.options.transport.message_bytes) {
    throw limit_exceeded("frame_count", "bytes of the frames (ask for fewer at a time)",
                         hub_.options.transport.message_bytes, frame_bytes);
  }
}

proto::GetGeometryResponse Service::get_geometry(const proto::GetGeometryRequest& request) {
  return kept_.find(request.session())->geometry(request);
}

proto::GetFramesResponse Service::get_frames(const proto::GetFramesRequest& request) {
  if (request.job() != 0) return get_job_frames(request);
  const auto frames = kept_.find(request.session())->frames(request.final_only());
  const FrameRange range =
      frame_range(request.first_frame(), request.frame_count(), frames->frame_count());
  if (request.encoding() == proto::ENCODING_SURFACE && !frames->has_surface())
    throw invalid("encoding", "the session's scene names no surface");
  demand_message_room(frames->bytes(request.encoding(), range.count));
  proto::GetFramesResponse response;
  *response.mutable_frames() = frames->encode(request.encoding(), range);
  return response;
}

proto::GetFramesResponse Service::get_job_frames(const proto::GetFramesRequest& request) const {
  if (!request.session().empty()) throw invalid("job", "give either a session or a job");
  if (request.encoding() != proto::ENCODING_UNSPECIFIED &&
      request.encoding() != proto::ENCODING_POSITIONS) {
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "encoding",
                  "frames of a job come as ENCODING_POSITIONS");
  }
  if (request.final_only()) throw invalid("final_only", "a job has one motion");
  const auto motion = hub_.jobs.motion(request.job());
  const FrameRange range =
      frame_range(request.first_frame(), request.frame_count(), motion->frame_count());
  demand_message_room(motion->bytes(range.count));
  proto::GetFramesResponse response;
  *response.mutable_frames() = motion->encode(range);
  return response;
}

proto::ExportResponse Service::export_part(const proto::ExportRequest& request) {
  if (request.job() == 0) return kept_.find(request.session())->export_part(request);
  if (!request.session().empty()) throw invalid("job", "give either a session or a job");
  return hub_.jobs.motion(request.job())->export_part(request);
}

}  // namespace limber::server
