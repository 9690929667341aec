// Frames and files of motions that jobs made (simulate, recover).
#include "server/kinds/bodies/export.h"
#include "server/kinds/bodies/frames.h"
#include "server/service/service.h"
#include "server/wire/errors.h"
#include "server/wire/file_stem.h"

namespace limber::server {
namespace {

/// Bytes of `count` frames as float32.
std::uint64_t positions_bytes(const ComputedMotion& motion, int count) {
  return static_cast<std::uint64_t>(motion.positions.rows()) * sizeof(float) *
         static_cast<std::uint64_t>(count);
}

proto::Frames encode_positions(const ComputedMotion& motion, FrameRange range) {
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

proto::GetFramesResponse Service::get_computed_frames(
    const proto::GetFramesRequest& request) const {
  if (!request.session().empty()) throw invalid("job", "give either a session or a job");
  if (request.encoding() != proto::ENCODING_UNSPECIFIED &&
      request.encoding() != proto::ENCODING_POSITIONS) {
    throw Refusal(proto::ERROR_CODE_UNSUPPORTED, "encoding",
                  "frames of a job come as ENCODING_POSITIONS");
  }
  if (request.final_only()) throw invalid("final_only", "a job has one motion");
  const auto motion = hub_.jobs.motion(request.job());
  const FrameRange range = frame_range(request.first_frame(), request.frame_count(),
                                       static_cast<int>(motion->positions.cols()));
  const std::uint64_t bytes = positions_bytes(*motion, range.count);
  if (bytes > hub_.options.transport.message_bytes) {
    throw limit_exceeded("frame_count", "bytes of the frames (ask for fewer at a time)",
                         hub_.options.transport.message_bytes, bytes);
  }
  proto::GetFramesResponse response;
  *response.mutable_frames() = encode_positions(*motion, range);
  return response;
}

proto::ExportResponse Service::export_computed_part(const proto::ExportRequest& request) const {
  if (!request.session().empty()) throw invalid("job", "give either a session or a job");
  demand_body_format(request.format());
  return export_computed(hub_.jobs.motion(request.job()), request.format(),
                         decode_file_stem(request.stem(), "motion"), request.part());
}

}  // namespace limber::server
