#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/post.hpp>

#include "engine/scene/keyframe_rules.h"
#include "server/kinds/beams/record.h"
#include "server/kinds/bodies/edit.h"
#include "server/kinds/bodies/field_paths.h"
#include "server/kinds/bodies/keyframe.h"
#include "server/kinds/bodies/memory_estimate.h"
#include "server/kinds/bodies/record.h"
#include "server/kinds/bodies/scenes.h"
#include "server/kinds/linkages/record.h"
#include "server/log/log.h"
#include "server/runtime/job_guard.h"
#include "server/service/service.h"
#include "server/wire/errors.h"

namespace limber::server {
namespace {

constexpr std::uint64_t kEditsAtOnce = 65536;

SessionRecord::Opened describe_body(const std::string& id, const proto::Scene& message,
                                    const scene::Scene& scene) {
  SessionRecord::Opened opened;
  opened.id = id;
  opened.name = scene.name;
  if (message.mesh().has_path() || message.mesh().has_sample()) opened.mesh_source = message.mesh();
  opened.nodes = scene.mesh.node_count();
  opened.tets = scene.mesh.tet_count();
  opened.frames = scene.frame_count;
  opened.length_unit = scene.length_unit_in_metres;
  opened.lanes = scene.model.mode_count;
  opened.keyframe_rows = keyframe_rows(scene);
  const std::size_t constraints = scene.constraints.size(), keyframes = scene.keyframes.size();
  opened.bytes =
      estimate_session_bytes(scene) - estimate_constraint_bytes(constraints, opened.lanes) -
      estimate_keyframe_bytes(keyframes, opened.keyframe_rows, constraints, opened.lanes) -
      estimate_pose_bytes(keyframes, opened.nodes);
  return opened;
}

/// Constraints after the edits, or nothing where only the session can tell.
std::optional<std::size_t> count_after(std::size_t before,
                                       const std::vector<session::BodyEdit>& edits) {
  for (const auto& edit : edits) {
    if (std::holds_alternative<session::Undo>(edit) || std::holds_alternative<session::Redo>(edit))
      return std::nullopt;
    if (std::holds_alternative<session::AddConstraint>(edit)) ++before;
    if (std::holds_alternative<session::RemoveConstraint>(edit)) before -= before > 0 ? 1 : 0;
  }
  return before;
}

template <class Kind>
std::size_t count_of(const std::vector<session::BodyEdit>& edits) {
  return static_cast<std::size_t>(std::count_if(
      edits.begin(), edits.end(),
      [](const session::BodyEdit& edit) { return std::holds_alternative<Kind>(edit); }));
}

/// A session that had to go for another.
void close_quietly(Record& record) {
  try {
    record.close();
    log::info("session {} gave its place to another", record.id());
  } catch (const std::exception& fault) {  // a client was quicker
    log::debug("closing {}: {}", record.id(), fault.what());
  }
}

}  // namespace

std::shared_ptr<SessionRecord> Service::find_body(const std::string& name, const char* what) const {
  const auto record = sessions_.find(name);
  if (auto body = std::dynamic_pointer_cast<SessionRecord>(record)) return body;
  throw Error(
      ErrorCode::kFailedPrecondition, "session",
      fmt::format("session '{}' is of {}: there is no {}", record->id(), record->subject(), what));
}

JobId Service::start_open_job(const SessionKey& key) {
  return hub_.jobs.start("open_session", key.name, [this, reference = key.reference()] {
    try {
      sessions_.find(reference)->cancel();
    } catch (const std::exception& fault) {
      log::debug("cancelling {}: {}", reference, fault.what());
    }
  });
}

void Service::put(const std::shared_ptr<Record>& record) {
  for (const auto& failed : sessions_.put(record)) close_quietly(*failed);
}

proto::OpenSessionResponse Service::open(const proto::OpenSessionRequest& request) {
  if (request.scene().has_linkage()) return open_linkage(request);
  if (request.scene().has_beams()) return open_beams(request);
  const auto name = sessions_.reserve(request.session());
  DecodedScene decoded = decode(request.scene());
  proto::OpenSessionResponse response;
  for (auto& issue : remarks(request.scene(), decoded, "scene."))
    *response.add_issues() = std::move(issue);
  demand_memory(decoded.scene, scene_limits(hub_.options.limits));
  const std::string& id = name->key().name;
  const JobId job = start_open_job(name->key());
  JobGuard guard(hub_.jobs, job);
  const auto record = std::make_shared<SessionRecord>(
      hub_, name->key(), describe_body(id, request.scene(), decoded.scene), job);
  session::SessionOptions options;
  options.max_constraints = static_cast<int>(hub_.options.limits.constraints);
  put(record);
  try {
    record->attach(std::make_shared<session::BodySession>(
        id, std::move(decoded.scene), options, hub_.cache,
        [this](std::function<void()> task) {
          boost::asio::post(hub_.session_pool, std::move(task));
        },
        record));
  } catch (const std::exception& fault) {
    sessions_.remove(*record);
    guard.fail(fault);
    if (const auto* error = dynamic_cast<const Error*>(&fault);
        error != nullptr && !error->field().empty()) {
      throw Error(error->code(), "scene." + error->field(), error->what());
    }
    throw;
  }
  guard.release();
  log::info("session {} opened: {} nodes, {} tets, {} frames", id, record->opened().nodes,
            record->opened().tets, record->opened().frames);
  response.set_session(id);
  response.set_uid(name->key().uid);
  response.set_job(job);
  return response;
}

proto::EditResponse Service::edit(const proto::EditRequest& request) {
  const auto found = sessions_.find(request.session());
  if (static_cast<std::uint64_t>(request.edits_size()) > kEditsAtOnce) {
    throw limit_exceeded("edits", "edits in one request", kEditsAtOnce,
                         static_cast<std::uint64_t>(request.edits_size()));
  }
  if (const auto linkage = std::dynamic_pointer_cast<LinkageRecord>(found))
    return edit_linkage(*linkage, request);
  if (const auto beams = std::dynamic_pointer_cast<BeamRecord>(found))
    return edit_beams(*beams, request);
  const auto record = find_body(request.session(), "constraint");
  const auto session = record->session();
  const auto edits = decode_edits(request, session->unedited()->mesh.nodes, mesh_loader());
  std::optional<session::Revision> expected;
  if (request.has_expected_revision()) expected = request.expected_revision();
  const std::size_t before = record->constraint_count();
  const auto after = count_after(before, edits);
  const std::size_t added = count_of<session::AddConstraint>(edits);
  const std::size_t poses = count_of<session::AddKeyframe>(edits);
  if (added + poses > 0) {
    record->demand_memory(after.value_or(before + added), session->keyframes().size() + poses);
  }
  try {
    const auto receipt = session->edit(edits, expected);
    // Edits with poses may be worked on beside others.
    const bool known = after && poses == 0;
    record->constraints_changed(known ? *after : session->constraints().size());
    return encode_receipt(receipt);
  } catch (const Error& error) {
    const std::string field = field_in(request, error.field());
    if (error.code() != ErrorCode::kLimitExceeded || field.ends_with(".nodes"))
      throw Error(error.code(), field, error.what());
    if (field.ends_with(".keyframe"))
      throw limit_exceeded(field, "keyframes", scene::kMaxKeyframes, scene::kMaxKeyframes + 1);
    const auto limit = hub_.options.limits.constraints;
    throw Refusal(proto::ERROR_CODE_LIMIT_EXCEEDED, field, error.what(),
                  {{"limit", std::to_string(limit)}, {"value", std::to_string(before + 1)}});
  }
}

void Service::wait(const proto::WaitRequest& request, const SharedTicket& ticket) {
  const auto record = sessions_.find(request.session());
  const double timeout = request.has_timeout_s() ? request.timeout_s() : 60.0;
  if (!(timeout > 0)) throw invalid("timeout_s", fmt::format("{} must be > 0", timeout));
  const auto until =
      request.until() == proto::WaitRequest::UNTIL_FIRST     ? ResultWaiters::Until::kFirst
      : request.until() == proto::WaitRequest::UNTIL_CHECKED ? ResultWaiters::Until::kChecked
                                                             : ResultWaiters::Until::kFinal;
  demand_room_to_wait(*ticket);
  record->waiters().wait(request.revision(), until, checked_seconds(timeout, "timeout_s"), ticket);
}

proto::ListSessionsResponse Service::list_sessions(const proto::ListSessionsRequest&) const {
  proto::ListSessionsResponse response;
  for (const auto& record : sessions_.all()) *response.add_sessions() = record->status();
  return response;
}

proto::GetSessionResponse Service::get_session(const proto::GetSessionRequest& request) const {
  const auto found = sessions_.find(request.session());
  if (const auto linkage = std::dynamic_pointer_cast<LinkageRecord>(found))
    return get_linkage_session(*linkage, request);
  if (const auto beams = std::dynamic_pointer_cast<BeamRecord>(found))
    return get_beam_session(*beams, request);
  const auto record = find_body(request.session(), "scene of a body");
  proto::GetSessionResponse response;
  *response.mutable_status() = record->status();
  if (!request.with_scene() && !request.with_base_motion()) return response;
  const scene::Scene scene = record->session()->scene();
  auto& message = *response.mutable_scene();
  message = encode_scene(scene);
  if (record->opened().mesh_source.source_case() != proto::MeshSource::SOURCE_NOT_SET)
    *message.mutable_mesh() = record->opened().mesh_source;
  if (!request.with_base_motion()) {
    response.set_base_motion_left_out(scene.base_motion.size() > 0);
    return response;
  }
  const std::uint64_t bytes =
      (static_cast<std::uint64_t>(scene.base_motion.size()) +
       scene.keyframes.size() * static_cast<std::uint64_t>(scene.mesh.nodes.size())) *
      sizeof(double);
  const std::uint64_t limit = hub_.options.transport.message_bytes;
  if (bytes > limit)
    throw limit_exceeded("with_base_motion", "bytes of the motion and poses", limit, bytes);
  encode_poses(scene, message);
  if (scene.base_motion.size() > 0) *message.mutable_base_motion() = encode_base_motion(scene);
  return response;
}

proto::CloseSessionResponse Service::close(const proto::CloseSessionRequest& request) {
  const auto record = sessions_.find(request.session());
  record->close();
  sessions_.remove(*record);  // the name is free only now
  return {};
}

proto::CancelResponse Service::cancel(const proto::CancelRequest& request) {
  switch (request.target_case()) {
    case proto::CancelRequest::kSession:
      sessions_.find(request.session())->cancel();
      break;
    case proto::CancelRequest::kJob:
      hub_.jobs.cancel(request.job());
      break;
    case proto::CancelRequest::TARGET_NOT_SET:
      throw invalid("target", "a session or a job is expected");
  }
  return {};
}

proto::SolveColdResponse Service::solve_cold(const proto::SolveColdRequest& request) {
  const auto record = find_body(request.session(), "cold solve");
  const auto session = record->session();
  const JobId job = hub_.jobs.start("solve_cold", record->id(), [record] {
    try {
      record->cancel();
    } catch (const std::exception& fault) {
      log::debug("cancelling a cold solve: {}", fault.what());
    }
  });
  JobGuard guard(hub_.jobs, job);
  record->expect_cold(job);
  guard.release();
  try {
    session->solve_cold(job);
  } catch (const std::exception& fault) {
    hub_.jobs.failed(job, error_to_proto(fault));
    throw;
  }
  proto::SolveColdResponse response;
  response.set_job(job);
  return response;
}

}  // namespace limber::server
