#include "server/kinds/bodies/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server/kinds/bodies/explain.h"
#include "server/kinds/bodies/export.h"
#include "server/kinds/bodies/frames.h"
#include "server/kinds/bodies/geometry.h"
#include "server/kinds/bodies/keyframe.h"
#include "server/kinds/bodies/material.h"
#include "server/kinds/bodies/memory_estimate.h"
#include "server/kinds/bodies/result.h"
#include "server/kinds/bodies/scene.h"
#include "server/log/log.h"
#include "server/runtime/job_guard.h"
#include "server/wire/arrays.h"
#include "server/wire/errors.h"
#include "server/wire/file_stem.h"

namespace limber::server {
namespace {

/// @throws Error{kFailedPrecondition} until the session's model is built
std::shared_ptr<const session::Geometry> geometry_of(const session::BodySession& session) {
  auto geometry = session.geometry();
  if (!geometry) throw model_not_built();
  return geometry;
}

}  // namespace

BodyRecord::BodyRecord(Hub& hub, SessionKey key, Opened opened, JobId open_job)
    : SessionRecord(hub, std::move(key), opened.name, open_job), opened_(std::move(opened)) {}

void BodyRecord::adopt_model() {
  const auto session = attached_session();
  if (!session) return;
  auto info = encode_model(*session);
  auto geometry = session->geometry();
  std::shared_ptr<const session::BodyResult> newest;
  {
    const std::lock_guard lock(mutex_);
    model_ = std::move(info);
    geometry_ = geometry;  // results that come from now on find it
    newest = newest_;
  }
  if (newest && geometry) streams_->note(frames_of(newest));
}

std::shared_ptr<BodyFrames> BodyRecord::frames_of(
    std::shared_ptr<const session::BodyResult> result) const {
  auto geometry = result->shown->geometry;
  return std::make_shared<BodyFrames>(std::move(result), std::move(geometry), opened_.length_unit,
                                      opened_.surface);
}

void BodyRecord::add_scene(const proto::GetSessionRequest& request,
                           proto::GetSessionResponse& response) const {
  const auto session = this->session();
  const scene::Scene scene = session->scene_without_base_motion();
  const session::PinPaths pins = session->pins();
  const Eigen::MatrixXd& motion = session->unedited()->base_motion;
  auto& message = *response.mutable_scene();
  message = encode_scene(scene);
  if (opened_.mesh_source.source_case() != proto::MeshSource::SOURCE_NOT_SET)
    *message.mutable_mesh() = opened_.mesh_source;
  // Edited paths are short, and in no file that a client has.
  if (pins) *message.mutable_base_motion()->mutable_pins() = encode_motion(*pins);
  if (!request.with_base_motion()) {
    response.set_base_motion_left_out(!pins && motion.size() > 0);
    return;
  }
  const std::uint64_t bytes =
      (static_cast<std::uint64_t>(pins ? 0 : motion.size()) +
       scene.keyframes.size() * static_cast<std::uint64_t>(scene.mesh.nodes.size())) *
      sizeof(double);
  const std::uint64_t limit = hub_.options.transport.message_bytes;
  if (bytes > limit)
    throw limit_exceeded("with_base_motion", "bytes of the motion and poses", limit, bytes);
  encode_poses(scene, message);
  if (!pins && motion.size() > 0)
    *message.mutable_base_motion() = encode_base_motion(*session->unedited());
}

bool BodyRecord::add_start(proto::Scene& scene) const {
  const auto result = session()->final_result();
  if (!result || result->solve_failed || result->is_first_picture || !result->material)
    return false;
  *scene.mutable_start() = encode_start(*result);
  return true;
}

std::shared_ptr<const FrameSource> BodyRecord::frames(bool final_only) const {
  (void)geometry_of(*session());
  return frames_of(demand_result(final_only));
}

proto::GetGeometryResponse BodyRecord::geometry(const proto::GetGeometryRequest& request) const {
  const auto session = this->session();
  auto geometry = geometry_of(*session);
  if (!request.basis_hash().empty() && request.basis_hash() != geometry->basis_hash)
    geometry = session->geometry(request.basis_hash());
  std::optional<proto::GetGeometryResponse> found;
  if (geometry)
    found = encode_geometry(*geometry, request.known_basis_hash());
  else
    found = geometry_in_transfer(request);
  if (!found)
    throw Error(ErrorCode::kNotFound, "basis_hash",
                "the session has no such basis any more: fetch newer frames");
  auto response = *std::move(found);
  if (request.with_surface() && opened_.surface)
    *response.mutable_carried_surface() = encode_carried_surface(*opened_.surface);
  return response;
}

proto::ExportResponse BodyRecord::export_part(const proto::ExportRequest& request) {
  const auto session = this->session();
  const std::string stem = decode_file_stem(request.stem(), "motion");
  demand_body_format(request.format());
  if (request.format() == proto::EXPORT_FORMAT_SCENE) {
    if (request.part() > 0)
      throw Refusal(proto::ERROR_CODE_OUT_OF_RANGE, "part", "a scene has one part");
    return export_scene(session->scene(), stem);
  }
  const auto geometry = geometry_of(*session);
  const bool is_of_surface = request.format() == proto::EXPORT_FORMAT_SURFACE;
  if (is_of_surface && !opened_.surface) throw invalid("format", kNoSurface);
  if (request.part() == 0) {
    auto newest = demand_result(false);
    if (newest->is_first_picture) throw model_not_built();
    exports_.begin(std::move(newest));
  }
  const auto result = exports_.find(request.part() == 0 ? 0 : request.result_sequence());
  const double fps = session->dynamics().frames_per_second;
  const auto positions = [&](int first, int count) {
    return session->positions(*result, first, count);
  };
  const int frames = static_cast<int>(result->coordinates.cols());
  auto response = MotionExport{geometry, frames, positions, stem, fps, opened_.surface}.part(
      request.format(), request.part());
  *response.mutable_result() = encode_result(*result, opened_.length_unit);
  return response;
}

bool BodyRecord::answer(const proto::Request& request, proto::Reply& reply) {
  switch (request.body_case()) {
    case proto::Request::kGetMaterial:
      *reply.mutable_get_material() = material(request.get_material());
      return true;
    case proto::Request::kExplain:
      *reply.mutable_explain() = explanation();
      return true;
    case proto::Request::kSolveCold:
      *reply.mutable_solve_cold() = solve_cold();
      return true;
    case proto::Request::kLookAt:
      look_at(request.look_at());
      reply.mutable_look_at();
      return true;
    default:
      return false;
  }
}

proto::GetMaterialResponse BodyRecord::material(const proto::GetMaterialRequest& request) const {
  const auto session = this->session();
  const auto result = demand_result(false);
  if (result->is_first_picture) throw model_not_built();
  proto::GetMaterialResponse response =
      encode_fitted_material(*result, session->dynamics().frames_per_second);
  response.set_variables(encode_variables(session->material_variables()));
  if (request.with_coordinates()) *response.mutable_coordinates() = encode_coordinates(*result);
  if (request.with_candidates() && response.has_mixing())
    add_candidates(*session, hub_.options.transport.message_bytes, response);
  *response.mutable_result() = encode_result(*result, opened_.length_unit);
  return response;
}

proto::ExplainResponse BodyRecord::explanation() const {
  const auto session = this->session();
  if (!session->model()) throw model_not_built();
  const auto columns = static_cast<int>(demand_result(false)->coordinates.rows());
  return explain_body(status(), *session, columns);
}

void BodyRecord::look_at(const proto::LookAtRequest& request) {
  const FrameRange frames =
      frame_range(request.first_frame(), request.frame_count(), opened_.frames);
  session()->look_at({frames.first, frames.count});
  streams_->look_at(frames);
}

proto::SolveColdResponse BodyRecord::solve_cold() {
  const auto session = this->session();
  const JobId job = hub_.jobs.start("solve_cold", id(), [record = shared_from_this()] {
    try {
      record->cancel();
    } catch (const std::exception& fault) {
      log::debug("cancelling a cold solve: {}", fault.what());
    }
  });
  JobGuard guard(hub_.jobs, job);
  expect_cold(job);
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

void BodyRecord::describe(proto::SessionStatus& status) const {
  status.set_nodes(static_cast<std::uint32_t>(opened_.nodes));
  status.set_tets(static_cast<std::uint32_t>(opened_.tets));
  status.set_frames(static_cast<std::uint32_t>(opened_.frames));
  const auto session = attached_session();
  {
    const std::lock_guard lock(mutex_);
    status.set_constraints(static_cast<std::uint32_t>(constraints_));
    if (model_) *status.mutable_model() = *model_;
    // The message describes the present model, which may have grown.
    if (model_ && state_ == session::State::kReady) status.set_message(model_->message());
  }
  if (session) status.set_revision(session->revision());
}

void BodyRecord::constraints_changed(std::size_t count) {
  const std::lock_guard lock(mutex_);
  constraints_ = count;
}

void BodyRecord::demand_memory(std::size_t constraints, std::size_t keyframes, Pins pins) const {
  std::uint64_t more = 0;
  const std::uint64_t limit = hub_.options.limits.session_bytes;
  int lanes = opened_.lanes;
  if (const auto session = attached_session()) {
    lanes = std::max(lanes, session->mode_choice().modes);
    const scene::Scene& scene = *session->unedited();
    if (pins == Pins::kEdited || session->pins()) more = estimate_base_motion_bytes(scene);
  }
  const std::uint64_t bytes =
      opened_.bytes + more + estimate_constraint_bytes(constraints, lanes) +
      estimate_keyframe_bytes(keyframes, std::max(opened_.keyframe_rows, lanes + 6), constraints,
                              lanes) +
      estimate_pose_bytes(keyframes, opened_.nodes, opened_.tets);
  if (bytes > limit) {
    throw limit_exceeded(
        "edits",
        fmt::format("estimated bytes of the session with {} constraints{}{}", constraints,
                    keyframes > 0 ? fmt::format(" and {} keyframes", keyframes) : "",
                    more > 0 ? " and animated pins" : ""),
        limit, bytes);
  }
}

std::size_t BodyRecord::constraint_count() const {
  const std::lock_guard lock(mutex_);
  return constraints_;
}

void BodyRecord::expect_cold(JobId job) {
  std::optional<JobId> earlier;
  {
    const std::lock_guard lock(mutex_);
    earlier = std::exchange(later_job_, job);
    if (state_ == session::State::kFailed) {  // a second try at the model
      state_ = session::State::kBuilding;
      message_.clear();
    }
  }
  waiters_.accept();
  if (earlier) hub_.jobs.cancelled(*earlier);  // started over
}

/// A cold job waits for a result that has its own solve in it: a warm one may become final between
/// the wish and its beginning.
void BodyRecord::take_ended_jobs(std::vector<JobId>& jobs) {
  if (later_job_ && newest_->cold_request >= *later_job_)
    jobs.push_back(*std::exchange(later_job_, std::nullopt));
}

void BodyRecord::on_result(const std::shared_ptr<const session::BodyResult>& result) {
  const auto session = result->is_final ? attached_session() : nullptr;
  if (session && session->model()) {  // it may have other modes now, or know more of them
    auto info = encode_model(*session);
    const std::lock_guard lock(mutex_);
    model_ = std::move(info);
  }
  note_result(
      std::make_shared<proto::ResultInfo>(encode_result(*result, opened_.length_unit)),
      [&]() -> std::shared_ptr<const FrameSource> {
        // Its modes were found to be enough, or no start is lower: streams have the frames already.
        const bool is_answered = newest_ && ((newest_->awaits_modes && !result->awaits_modes) ||
                                             (newest_->awaits_starts && !result->awaits_starts));
        const bool is_sent = is_answered && newest_->revision == result->revision &&
                             newest_->mode_changes == result->mode_changes &&
                             newest_->check == result->check;
        newest_ = result;
        if (is_sent) return nullptr;
        if (!geometry_ && !result->is_first_picture) return nullptr;
        return frames_of(result);
      },
      result->check == session::Check::kPending || result->is_followed()
          ? ResultWaiters::Check::kPending
          : ResultWaiters::Check::kDone);
}

void BodyRecord::on_early_frames(
    const std::vector<std::shared_ptr<const session::BodyResult>>& parts) {
  std::vector<std::shared_ptr<const FrameSource>> frames;
  frames.reserve(parts.size());
  for (const auto& part : parts) frames.push_back(frames_of(part));
  streams_->note_early(frames);
}

}  // namespace limber::server
