#include "server/kinds/linkages/design_requests.h"

#include <optional>
#include <utility>

#include "engine/scene/formats/surface_formats.h"
#include "server/log/log.h"
#include "server/wire/arrays.h"
#include "server/wire/fields.h"

namespace limber::server {
namespace {

proto::StartDesignResponse start_design(LinkageRecord& record,
                                        const proto::StartDesignRequest& request) {
  const auto session = record.session();
  session::DesignRequest design = decode_design(request, surface_loader(record.opened().resolve));
  const JobId job = record.jobs().start("design", record.id(), [session] {
    try {
      session->stop_design();
    } catch (const std::exception& fault) {  // it has just ended
      log::debug("stopping a design: {}", fault.what());
    }
  });
  try {
    with_fields_of(request, "", [&] { session->start_design(std::move(design), job); });
  } catch (const std::exception& fault) {
    record.jobs().failed(job, error_to_proto(fault));
    throw;
  }
  proto::StartDesignResponse response;
  response.set_job(job);
  return response;
}

void change_design(const LinkageRecord& record, const proto::ChangeDesignRequest& request) {
  const auto session = record.session();
  const session::DesignChange change =
      decode_design_change(request, surface_loader(record.opened().resolve));
  with_fields_of(request, "", [&] { session->change_design(change); });
}

proto::TakeDesignResponse take_design(const LinkageRecord& record,
                                      const proto::TakeDesignRequest& request) {
  std::optional<session::Revision> expected;
  if (request.has_expected_revision()) expected = request.expected_revision();
  proto::TakeDesignResponse response;
  response.set_revision(record.session()->take_design(expected).revision);
  return response;
}

proto::GetDesignResponse get_design(const LinkageRecord& record) {
  proto::GetDesignResponse response;
  const auto [info, best] = record.session()->newest_design();
  if (info) *response.mutable_design() = encode_design(*info, record.opened().length_unit);
  if (best) {
    encode_numbers(best->sizes.segments, *response.mutable_best_lengths());
    if (best->variables.lengths == rods::LengthVariables::kEdges)
      encode_numbers(best->sizes.edges, *response.mutable_best_edge_lengths());
    if (best->variables.sections == rods::SectionVariables::kSegments)
      encode_numbers(best->sizes.sections, *response.mutable_best_section_scales());
  }
  return response;
}

}  // namespace

SurfaceLoader surface_loader(PathResolver resolve) {
  return [resolve = std::move(resolve)](const std::string& path, const std::string& field) {
    const auto file = resolve(path, field);
    return read_at(field, [&] { return scene::read_surface_file(file); });
  };
}

bool answer_design_request(LinkageRecord& record, const proto::Request& request,
                           proto::Reply& reply) {
  switch (request.body_case()) {
    case proto::Request::kStartDesign:
      *reply.mutable_start_design() = start_design(record, request.start_design());
      return true;
    case proto::Request::kChangeDesign:
      change_design(record, request.change_design());
      reply.mutable_change_design();
      return true;
    case proto::Request::kPauseDesign:
      record.session()->pause_design();
      reply.mutable_pause_design();
      return true;
    case proto::Request::kResumeDesign:
      record.session()->resume_design();
      reply.mutable_resume_design();
      return true;
    case proto::Request::kStopDesign:
      record.session()->stop_design();
      reply.mutable_stop_design();
      return true;
    case proto::Request::kTakeDesign:
      *reply.mutable_take_design() = take_design(record, request.take_design());
      return true;
    case proto::Request::kGetDesign:
      *reply.mutable_get_design() = get_design(record);
      return true;
    default:
      return false;
  }
}

}  // namespace limber::server
