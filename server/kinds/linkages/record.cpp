#include "server/kinds/linkages/record.h"

#include <fmt/format.h>

#include <utility>

#include "server/kinds/linkages/checkpoint.h"
#include "server/kinds/linkages/design.h"
#include "server/kinds/linkages/design_requests.h"
#include "server/kinds/linkages/edit.h"
#include "server/kinds/linkages/explain.h"
#include "server/kinds/linkages/export.h"
#include "server/kinds/linkages/result.h"
#include "server/kinds/linkages/scene.h"
#include "server/runtime/stream_message.h"
#include "server/wire/arrays.h"

namespace limber::server {

LinkageRecord::LinkageRecord(Hub& hub, SessionKey key, Opened opened, JobId open_job)
    : SessionRecord(hub, std::move(key), opened.name, open_job),
      opened_(std::move(opened)),
      design_topic_(fmt::format("session/{}/design", opened_.id)) {}

void LinkageRecord::adopt_model() {
  const auto session = attached_session();
  if (!session) return;
  std::shared_ptr<const session::LinkageResult> newest;
  {
    const std::lock_guard lock(mutex_);
    is_ready_ = true;
    newest = newest_;
  }
  if (newest) streams_->note(std::make_shared<LinkageFrames>(newest, opened_.length_unit));
}

void LinkageRecord::note_closed(session::LinkageSession& session) {
  // A design that had not ended, or not even begun, reports nothing any more.
  if (const auto design = session.design()) hub_.jobs.cancelled(design->tag);
}

void LinkageRecord::on_design(const std::shared_ptr<const session::DesignInfo>& info) {
  {
    const std::lock_guard lock(mutex_);
    design_ = info;
  }
  publish_design(*info);
  if (info->taken) note_own_edits(*info->taken);
  if (info->state != session::DesignState::kEnded) {
    const char* const stage =
        info->state == session::DesignState::kPaused ? "design paused" : "design";
    hub_.jobs.progress(info->tag,
                       {stage, static_cast<double>(info->iteration) / info->max_iterations});
  } else if (info->end == session::DesignEnd::kFailed) {
    hub_.jobs.failed(info->tag, encode_design(*info, opened_.length_unit).error());
  } else if (info->end == session::DesignEnd::kStopped && !info->taken) {
    hub_.jobs.cancelled(info->tag);
  } else {
    hub_.jobs.done(info->tag);
  }
}

bool LinkageRecord::is_at_rest() const {
  const auto design = session()->newest_design().info;
  return !design || (design->state == session::DesignState::kEnded && design->taken);
}

void LinkageRecord::publish_design(const session::DesignInfo& info) {
  if (!hub_.transport.has_subscriber(design_topic_)) return;
  auto message = stream_message(hub_.run, id(), key().uid);
  *message.mutable_design() = encode_design(info, opened_.length_unit);
  hub_.transport.publish(design_topic_, {message.SerializeAsString()});
}

void LinkageRecord::welcome_more(const std::string& prefix) {
  if (design_topic_.compare(0, prefix.size(), prefix) != 0) return;
  std::shared_ptr<const session::DesignInfo> info;
  {
    const std::lock_guard lock(mutex_);
    info = design_;
  }
  if (info) publish_design(*info);
}

proto::EditResponse LinkageRecord::edit(const proto::EditRequest& request,
                                        const session::Author& author) {
  return encode_linkage_receipt(make_edits(request, decode_linkage_edits(request), author));
}

std::optional<proto::EditRequest> LinkageRecord::made_edits(const proto::Request& request) const {
  if (!request.has_take_design()) return Record::made_edits(request);
  const auto info = session()->design();
  return own_edits(info && info->taken ? *info->taken : 0);
}

proto::EditRequest LinkageRecord::own_edits(std::uint64_t revision) const {
  const auto [info, best] = session()->newest_design();
  proto::EditRequest made;
  if (!info || info->taken != revision || !best) return made;
  const auto& sizes = best->sizes;
  if (best->variables.lengths == rods::LengthVariables::kSegments)
    encode_numbers(sizes.segments,
                   *made.add_edits()->mutable_set_segment_lengths()->mutable_lengths());
  if (best->variables.lengths == rods::LengthVariables::kEdges)
    encode_numbers(sizes.edges, *made.add_edits()->mutable_set_edge_lengths()->mutable_lengths());
  if (best->variables.sections == rods::SectionVariables::kSegments)
    encode_numbers(sizes.sections,
                   *made.add_edits()->mutable_set_section_scales()->mutable_scales());
  // Last: sizes put an end to it.
  *made.add_edits()->mutable_set_erection()->mutable_erection() =
      encode_erection(*session::erection_of(*info));
  return made;
}

bool LinkageRecord::add_start(proto::Scene& scene) const {
  const auto session = this->session();
  if (!session->final_result()) return false;
  const scene::Linkage linkage = session->linkage_in_shape();
  if (!linkage.shape) return false;
  const proto::Scene in_shape = encode_linkage(linkage);
  *scene.mutable_linkage()->mutable_shape() = in_shape.linkage().shape();
  scene.mutable_linkage()->set_edges_per_segment(in_shape.linkage().edges_per_segment());
  return true;
}

Record::CheckpointWriter LinkageRecord::checkpoint() const {
  const auto session = this->session();
  return [session, checkpoint = session->checkpoint()](proto::StoredCheckpoint& message) {
    message.set_revision(checkpoint.revision);
    *message.mutable_linkage() = encode_linkage_checkpoint(checkpoint);
    session->demand_reachable(decode_linkage_checkpoint(message.linkage(), checkpoint.revision));
  };
}

void LinkageRecord::begin_at(const proto::StoredCheckpoint& checkpoint) {
  demand_document(checkpoint.has_linkage());
  session()->begin_at(decode_linkage_checkpoint(checkpoint.linkage(), checkpoint.revision()));
}

void LinkageRecord::add_scene(const proto::GetSessionRequest&,
                              proto::GetSessionResponse& response) const {
  *response.mutable_scene() = encode_linkage(session()->linkage());
  if (opened_.lines.source_case() != proto::LineSource::SOURCE_NOT_SET)
    *response.mutable_scene()->mutable_linkage()->mutable_lines() = opened_.lines;
}

proto::ExportResponse LinkageRecord::export_part(const proto::ExportRequest& request) {
  return export_linkage(*this, request);
}

bool LinkageRecord::answer(const proto::Request& request, proto::Reply& reply) {
  if (request.has_explain()) {
    proto::GetSessionResponse response;
    add_scene({}, response);
    *reply.mutable_explain() =
        explain_linkage(status(), response.scene().linkage(),
                        session()->chose_edges() ? ChosenBy::kLimber : ChosenBy::kScene);
    return true;
  }
  return answer_design_request(*this, request, reply);
}

std::shared_ptr<const FrameSource> LinkageRecord::frames(bool final_only) const {
  if (!session()->geometry()) throw model_not_built();
  return std::make_shared<LinkageFrames>(demand_result(final_only), opened_.length_unit);
}

proto::GetGeometryResponse LinkageRecord::geometry(const proto::GetGeometryRequest& request) const {
  const auto geometry = session()->geometry();
  if (!geometry) throw model_not_built();
  if (!request.basis_hash().empty() && request.basis_hash() != geometry->hash) {
    if (auto kept = geometry_in_transfer(request)) return *std::move(kept);
    throw Error(ErrorCode::kNotFound, "basis_hash",
                "the linkage has other edges now: fetch newer frames");
  }
  return encode_linkage_geometry(*geometry, request.known_basis_hash());
}

void LinkageRecord::describe(proto::SessionStatus& status) const {
  status.set_joints(static_cast<std::uint32_t>(opened_.joints));
  status.set_segments(static_cast<std::uint32_t>(opened_.segments));
  const auto session = attached_session();
  if (!session) return;
  status.set_revision(session->revision());
  status.set_targets(static_cast<std::uint32_t>(session->conditions()->targets.size()));
}

void LinkageRecord::on_result(const std::shared_ptr<const session::LinkageResult>& result) {
  note_result(
      std::make_shared<proto::ResultInfo>(encode_linkage_result(*result, opened_.length_unit)),
      [&]() -> std::shared_ptr<const FrameSource> {
        newest_ = result;
        if (!is_ready_) return nullptr;
        return std::make_shared<LinkageFrames>(result, opened_.length_unit);
      },
      result->check == session::Check::kPending ? ResultWaiters::Check::kPending
                                                : ResultWaiters::Check::kDone);
}

}  // namespace limber::server
