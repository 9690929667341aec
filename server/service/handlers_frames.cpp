// Frames and files, of sessions and of motions that jobs made.
#include <algorithm>

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
  const auto record = kept_.find(request.session());
  const std::uint64_t begun = request.result_sequence();
  const auto now = FrameTransfers::Clock::now();
  FrameTransfers& transfers = record->frame_transfers();
  auto frames = begun != 0 ? transfers.find(begun, now) : record->frames(request.final_only());
  const FrameRange range =
      frame_range(request.first_frame(), request.frame_count(), frames->frame_count());
  if (request.encoding() == proto::ENCODING_SURFACE && !frames->has_surface())
    throw invalid("encoding", "the session's scene names no surface");
  // A result without a number cannot be requested again.
  FrameRange part = range;
  if (request.most_bytes() != 0 && frames->sequence() != 0)
    part.count =
        frames_within(most_bytes_of(request), frames->bytes(request.encoding(), 1), range.count);
  demand_message_room(frames->bytes(request.encoding(), part.count));
  if (begun == 0 && part.count < range.count) {
    using enum FrameTransfers::WithoutRoom;
    const bool is_small =
        frames->bytes(request.encoding(), range.count) <= hub_.options.transport.message_bytes;
    if (auto kept = transfers.begin(frames, is_small ? kBeginNone : kDisplace, now)) {
      frames = std::move(kept);
    } else {
      part = range;
    }
  }
  proto::GetFramesResponse response;
  *response.mutable_frames() = frames->encode(request.encoding(), part);
  const int left = range.count - part.count;
  response.set_frames_left(static_cast<std::uint32_t>(left));
  if (begun != 0 && left == 0) transfers.note_last(begun);
  return response;
}

std::uint64_t Service::most_bytes_of(const proto::GetFramesRequest& request) const {
  return std::min(request.most_bytes(), hub_.options.transport.message_bytes);
}

proto::GetFramesResponse Service::get_job_frames(const proto::GetFramesRequest& request) const {
  if (!request.session().empty()) throw invalid("job", "give either a session or a job");
  if (request.encoding() != proto::ENCODING_UNSPECIFIED &&
      request.encoding() != proto::ENCODING_POSITIONS) {
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "encoding",
                  "frames of a job come as ENCODING_POSITIONS");
  }
  if (request.final_only()) throw invalid("final_only", "a job has one motion");
  if (request.result_sequence() != 0) throw invalid("result_sequence", "a job has one motion");
  const auto motion = hub_.jobs.motion(request.job());
  const FrameRange range =
      frame_range(request.first_frame(), request.frame_count(), motion->frame_count());
  FrameRange part = range;
  if (request.most_bytes() != 0)
    part.count = frames_within(most_bytes_of(request), motion->bytes(1), range.count);
  demand_message_room(motion->bytes(part.count));
  proto::GetFramesResponse response;
  *response.mutable_frames() = motion->encode(part);
  response.set_frames_left(static_cast<std::uint32_t>(range.count - part.count));
  return response;
}

void Service::get_reply_part(const proto::GetReplyPartRequest& request,
                             const SharedTicket& ticket) {
  proto::Reply reply;
  *reply.mutable_get_reply_part() =
      reply_parts_.part(ticket->client(), request, ReplyParts::Clock::now());
  ticket->answer(std::move(reply));
}

proto::ExportResponse Service::export_part(const proto::ExportRequest& request) {
  if (request.job() == 0) return kept_.find(request.session())->export_part(request);
  if (!request.session().empty()) throw invalid("job", "give either a session or a job");
  return hub_.jobs.motion(request.job())->export_part(request);
}

}  // namespace limber::server
