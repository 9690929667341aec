#include "server/kinds/beams/record.h"

#include <utility>

#include "engine/session/beams/document.h"
#include "server/kinds/beams/edit.h"
#include "server/kinds/beams/export.h"
#include "server/kinds/beams/result.h"
#include "server/kinds/beams/scene.h"
#include "server/wire/edit_fields.h"
#include "server/wire/issues.h"

namespace limber::server {

BeamRecord::BeamRecord(Hub& hub, SessionKey key, DecodedBeams opened, JobId open_job)
    : SessionRecord(hub, std::move(key), opened.name, open_job), opened_(std::move(opened)) {}

proto::EditResponse BeamRecord::edit(const proto::EditRequest& request) {
  const auto session = this->session();
  const auto edits = decode_beam_edits(request, opened_.model.nodes);
  try {
    const session::EditReceipt receipt = session->edit(edits, expected_revision(request));
    proto::EditResponse response = encode_beam_receipt(receipt);
    add_issues(request, receipt.issues, response);
    return response;
  } catch (const Error& error) {
    const std::string field = edit_field_in(request, error.field());
    if (is_too_many_steps(error))
      throw too_many_steps(field, error, session::BeamLimits{}.steps_at_once);
    throw Error(error.code(), field, error.what());
  }
}

void BeamRecord::add_scene(const proto::GetSessionRequest&,
                           proto::GetSessionResponse& response) const {
  *response.mutable_scene() =
      encode_beam_scene({opened_.name, session()->model(), opened_.sections, std::nullopt});
}

proto::ExportResponse BeamRecord::export_part(const proto::ExportRequest& request) {
  return export_beams(*this, request);
}

bool BeamRecord::answer(const proto::Request& request, proto::Reply& reply) {
  if (!request.has_get_beam_solution()) return false;
  *reply.mutable_get_beam_solution() = beam_solution(*this);
  return true;
}

std::shared_ptr<const FrameSource> BeamRecord::frames(bool final_only) const {
  const auto session = this->session();
  auto result = final_only ? session->final_result() : session->newest_result();
  if (!result) throw Error(ErrorCode::kFailedPrecondition, "session", "there is no result yet");
  return std::make_shared<BeamFrames>(std::move(result));
}

std::shared_ptr<const session::BeamResult> BeamRecord::final_result() const {
  auto result = session()->final_result();
  if (!result)
    throw Error(ErrorCode::kFailedPrecondition, "session", "there is no final result yet");
  return result;
}

proto::GetGeometryResponse BeamRecord::geometry(const std::string&) const {
  (void)session();
  return encode_beam_geometry(opened_.model);
}

void BeamRecord::describe(proto::SessionStatus& status) const {
  status.set_beam_nodes(static_cast<std::uint32_t>(opened_.model.nodes.size()));
  status.set_beam_elements(static_cast<std::uint32_t>(opened_.model.elements.size()));
  if (const auto session = attached_session()) status.set_revision(session->revision());
}

void BeamRecord::on_result(const std::shared_ptr<const session::BeamResult>& result) {
  note_result(std::make_shared<proto::ResultInfo>(encode_beam_result(*result)),
              [&] { return std::make_shared<BeamFrames>(result); });
}

}  // namespace limber::server
