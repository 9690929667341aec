#include "server/kinds/beams/record.h"

#include <algorithm>
#include <utility>

#include "server/kinds/beams/checkpoint.h"
#include "server/kinds/beams/edit.h"
#include "server/kinds/beams/explain.h"
#include "server/kinds/beams/export.h"
#include "server/kinds/beams/result.h"
#include "server/kinds/beams/scene.h"
#include "server/kinds/beams/shape.h"
#include "server/kinds/beams/structure.h"
#include "server/wire/indices.h"

namespace limber::server {

BeamRecord::BeamRecord(Hub& hub, SessionKey key, DecodedBeams opened, JobId open_job)
    : SessionRecord(hub, std::move(key), opened.name, open_job), opened_(std::move(opened)) {}

namespace {

/// A hold is stored with the values after the request, which an undo removes.
void demand_held_apart(const proto::EditRequest& request) {
  bool holds = false, undoes = false;
  for (const proto::Edit& edit : request.edits()) {
    holds |= edit.has_hold_beam_node();
    undoes |= edit.has_undo() || edit.has_redo();
  }
  if (holds && undoes)
    throw Error(ErrorCode::kUnsupported, "edits",
                "a server that stores its sessions takes hold_beam_node and undo or redo in "
                "requests of their own");
}

}  // namespace

proto::EditResponse BeamRecord::edit(const proto::EditRequest& request,
                                     const session::Author& author) {
  if (hub_.store) demand_held_apart(request);
  return encode_beam_receipt(
      make_edits(request, decode_beam_edits(request, opened_.model.nodes), author));
}

void BeamRecord::add_scene(const proto::GetSessionRequest&,
                           proto::GetSessionResponse& response) const {
  *response.mutable_scene() = encode_beam_scene(
      {opened_.name, session()->model(), opened_.sections, std::nullopt, opened_.discretisation});
}

std::optional<proto::EditRequest> BeamRecord::made_edits(const proto::Request& request) const {
  auto made = Record::made_edits(request);
  if (!made) return made;
  const auto conditions = session()->conditions();
  made->clear_edits();
  for (proto::Edit edit : request.edit().edits()) {
    if (!edit.has_hold_beam_node()) {
      *made->add_edits() = std::move(edit);
      continue;
    }
    const int node = decode_index(edit.hold_beam_node().node(), "node");
    const auto& motions = conditions->motions;
    const auto motion = std::find_if(motions.begin(), motions.end(),
                                     [node](const auto& one) { return one.node == node; });
    // Released by what follows in the same request.
    if (motion == motions.end()) continue;
    encode_beam_motion(*motion, *made->add_edits()->mutable_move_beam_node()->mutable_motion());
  }
  return made;
}

bool BeamRecord::add_start(proto::Scene& scene) const {
  const auto result = session()->final_result();
  if (!result || !result->analysis) return false;
  *scene.mutable_beams()->mutable_shape() = encode_beam_shape(result->analysis->solution.state);
  return true;
}

Record::CheckpointWriter BeamRecord::checkpoint() const {
  const auto session = this->session();
  return [session, checkpoint = session->checkpoint()](proto::StoredCheckpoint& message) {
    message.set_revision(checkpoint.revision);
    *message.mutable_beams() = encode_beam_checkpoint(checkpoint);
    session->demand_reachable(decode_beam_checkpoint(message.beams(), checkpoint.revision));
  };
}

void BeamRecord::begin_at(const proto::StoredCheckpoint& checkpoint) {
  demand_document(checkpoint.has_beams());
  session()->begin_at(decode_beam_checkpoint(checkpoint.beams(), checkpoint.revision()));
}

proto::ExportResponse BeamRecord::export_part(const proto::ExportRequest& request) {
  return export_beams(*this, request);
}

bool BeamRecord::answer(const proto::Request& request, proto::Reply& reply) {
  if (request.has_explain()) {
    proto::GetSessionResponse response;
    add_scene({}, response);
    *reply.mutable_explain() = explain_beams(status(), response.scene().beams());
    return true;
  }
  if (!request.has_get_beam_solution()) return false;
  *reply.mutable_get_beam_solution() = beam_solution(*this, request.get_beam_solution());
  return true;
}

std::shared_ptr<const FrameSource> BeamRecord::frames(bool final_only) const {
  return std::make_shared<BeamFrames>(demand_result(final_only));
}

proto::GetGeometryResponse BeamRecord::geometry(const proto::GetGeometryRequest&) const {
  (void)session();
  return encode_beam_geometry(opened_.model);
}

void BeamRecord::describe(proto::SessionStatus& status) const {
  status.set_beam_nodes(static_cast<std::uint32_t>(opened_.model.nodes.size()));
  status.set_beam_elements(static_cast<std::uint32_t>(opened_.model.elements.size()));
  if (const auto session = attached_session()) status.set_revision(session->revision());
}

void BeamRecord::on_result(const std::shared_ptr<const session::BeamResult>& result) {
  note_result(
      std::make_shared<proto::ResultInfo>(encode_beam_result(*result)),
      [&] { return std::make_shared<BeamFrames>(result); },
      result->check == session::Check::kPending ? ResultWaiters::Check::kPending
                                                : ResultWaiters::Check::kDone);
}

}  // namespace limber::server
