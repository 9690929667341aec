#include <fmt/format.h>

#include "server/kinds/beams/export.h"
#include "server/kinds/bodies/export.h"
#include "server/kinds/bodies/material.h"
#include "server/kinds/bodies/record.h"
#include "server/kinds/bodies/result.h"
#include "server/kinds/bodies/scene.h"
#include "server/kinds/linkages/export.h"
#include "server/service/service.h"
#include "server/wire/errors.h"
#include "server/wire/file_stem.h"
#include "server/wire/frame_source.h"

namespace limber::server {
proto::GetGeometryResponse Service::get_geometry(const proto::GetGeometryRequest& request) const {
  return sessions_.find(request.session())->geometry(request.known_basis_hash());
}

proto::GetMaterialResponse Service::get_material(const proto::GetMaterialRequest& request) const {
  const auto record = find_body(request.session(), "fitted material");
  const auto session = record->session();
  const auto result = session->newest_result();
  if (!result) throw Error(ErrorCode::kFailedPrecondition, "session", "there is no result yet");
  proto::GetMaterialResponse response =
      encode_fitted_material(*result, session->dynamics().frames_per_second);
  response.set_variables(encode_variables(session->material_variables()));
  *response.mutable_result() = encode_result(*result, record->opened().length_unit);
  return response;
}

proto::GetFramesResponse Service::get_frames(const proto::GetFramesRequest& request) const {
  if (request.job() != 0) return get_computed_frames(request);
  const auto frames = sessions_.find(request.session())->frames(request.final_only());
  const FrameRange range =
      frame_range(request.first_frame(), request.frame_count(), frames->frame_count());
  const std::uint64_t bytes = frames->bytes(request.encoding(), range.count);
  if (bytes > hub_.options.transport.message_bytes) {
    throw limit_exceeded("frame_count", "bytes of the frames (ask for fewer at a time)",
                         hub_.options.transport.message_bytes, bytes);
  }
  proto::GetFramesResponse response;
  *response.mutable_frames() = frames->encode(request.encoding(), range);
  return response;
}

proto::ExportResponse Service::export_part(const proto::ExportRequest& request) const {
  if (request.job() != 0) return export_computed_part(request);
  const auto found = sessions_.find(request.session());
  if (const auto linkage = std::dynamic_pointer_cast<LinkageRecord>(found))
    return export_linkage(*linkage, request);
  if (const auto beams = std::dynamic_pointer_cast<BeamRecord>(found))
    return export_beams(*beams, request);
  const auto record = find_body(request.session(), "export of files");
  const auto session = record->session();
  const std::string stem = decode_file_stem(request.stem(), "motion");
  demand_body_format(request.format());
  if (request.format() == proto::EXPORT_FORMAT_SCENE) {
    if (request.part() > 0)
      throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, "part", "a scene has one part");
    return export_scene(session->scene(), stem);
  }
  const auto geometry = geometry_of(*session);
  if (request.part() == 0) {
    auto newest = session->newest_result();
    if (!newest) throw Error(ErrorCode::kFailedPrecondition, "session", "there is no result yet");
    record->exports().begin(std::move(newest));
  }
  const auto result = record->exports().find(request.part() == 0 ? 0 : request.result_sequence());
  const double fps = session->scene().dynamics.frames_per_second;
  const auto positions = [&](int first, int count) {
    return session->positions(*result, first, count);
  };
  const int frames = static_cast<int>(result->coordinates.cols());
  auto response =
      MotionExport{geometry, frames, positions, stem, fps}.part(request.format(), request.part());
  *response.mutable_result() = encode_result(*result, record->opened().length_unit);
  return response;
}

}  // namespace limber::server
