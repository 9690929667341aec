// Designs of rod linkages, live.
#include <fmt/format.h>

#include "engine/scene/formats/surface_formats.h"
#include "server/kinds/linkages/design.h"
#include "server/kinds/linkages/record.h"
#include "server/log/log.h"
#include "server/service/service.h"
#include "server/wire/arrays.h"

namespace limber::server {
namespace {

/// Fields of the engine's errors become those of the request.
template <class Request, class Call>
auto with_design_fields(const Request& request, const Call& call) {
  try {
    return call();
  } catch (const Error& error) {
    throw Error(error.code(), design_field_in(request, error.field()), error.what());
  }
}

}  // namespace

std::shared_ptr<LinkageRecord> Service::find_linkage(const std::string& name) const {
  const auto record = sessions_.find(name);
  if (auto linkage = std::dynamic_pointer_cast<LinkageRecord>(record)) return linkage;
  throw Error(
      ErrorCode::kFailedPrecondition, "session",
      fmt::format("session '{}' is of {}: there is no design", record->id(), record->subject()));
}

SurfaceLoader Service::surface_loader() const {
  return [this](const std::string& path, const std::string& field) {
    const auto file = meshes_.resolve(path, field);
    try {
      return scene::read_surface_file(file);
    } catch (const Error& error) {
      throw Error(error.code(), field, error.what());
    }
  };
}

proto::StartDesignResponse Service::start_design(const proto::StartDesignRequest& request) {
  const auto record = find_linkage(request.session());
  const auto session = record->session();
  session::DesignRequest design = decode_design(request, surface_loader());
  const JobId job = hub_.jobs.start("design", record->id(), [session] {
    try {
      session->stop_design();
    } catch (const std::exception& fault) {  // it has just ended
      log::debug("stopping a design: {}", fault.what());
    }
  });
  try {
    with_design_fields(request, [&] { session->start_design(std::move(design), job); });
  } catch (const std::exception& fault) {
    hub_.jobs.failed(job, error_to_proto(fault));
    throw;
  }
  proto::StartDesignResponse response;
  response.set_job(job);
  return response;
}

proto::ChangeDesignResponse Service::change_design(const proto::ChangeDesignRequest& request) {
  const auto session = find_linkage(request.session())->session();
  const session::DesignChange change = decode_design_change(request, surface_loader());
  with_design_fields(request, [&] { session->change_design(change); });
  return {};
}

proto::PauseDesignResponse Service::pause_design(const proto::PauseDesignRequest& request) {
  find_linkage(request.session())->session()->pause_design();
  return {};
}

proto::ResumeDesignResponse Service::resume_design(const proto::ResumeDesignRequest& request) {
  find_linkage(request.session())->session()->resume_design();
  return {};
}

proto::StopDesignResponse Service::stop_design(const proto::StopDesignRequest& request) {
  find_linkage(request.session())->session()->stop_design();
  return {};
}

proto::MakeStartingGridResponse Service::starting_grid(
    const proto::MakeStartingGridRequest& request) {
  return make_starting_grid(request, surface_loader());
}

proto::TakeDesignResponse Service::take_design(const proto::TakeDesignRequest& request) {
  std::optional<session::Revision> expected;
  if (request.has_expected_revision()) expected = request.expected_revision();
  proto::TakeDesignResponse response;
  response.set_revision(find_linkage(request.session())->session()->take_design(expected).revision);
  return response;
}

proto::GetDesignResponse Service::get_design(const proto::GetDesignRequest& request) const {
  const auto record = find_linkage(request.session());
  const auto session = record->session();
  proto::GetDesignResponse response;
  const auto [info, best] = session->newest_design();
  if (info) *response.mutable_design() = encode_design(*info, record->opened().length_unit);
  if (best) {
    encode_numbers(best->sizes.segments, *response.mutable_best_lengths());
    if (best->variables.lengths == rods::LengthVariables::kEdges)
      encode_numbers(best->sizes.edges, *response.mutable_best_edge_lengths());
    if (best->variables.sections == rods::SectionVariables::kSegments)
      encode_numbers(best->sizes.sections, *response.mutable_best_section_scales());
  }
  return response;
}

}  // namespace limber::server
