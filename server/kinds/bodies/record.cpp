#include "server/kinds/bodies/record.h"

#include <fmt/format.h>

#include <utility>

#include "server/kinds/bodies/frame_source.h"
#include "server/kinds/bodies/geometry.h"
#include "server/kinds/bodies/memory_estimate.h"
#include "server/kinds/bodies/result.h"
#include "server/wire/errors.h"

namespace limber::server {

std::shared_ptr<const session::Geometry> geometry_of(const session::BodySession& session) {
  auto geometry = session.geometry();
  if (!geometry)
    throw Error(ErrorCode::kFailedPrecondition, "session", "the model is not built yet");
  return geometry;
}

SessionRecord::SessionRecord(Hub& hub, SessionKey key, Opened opened, JobId open_job)
    : Record(hub, std::move(key), opened.name, open_job), opened_(std::move(opened)) {}

void SessionRecord::attach(std::shared_ptr<session::BodySession> session) {
  const std::size_t constraints = session->constraints().size();
  bool ready = false;
  {
    const std::lock_guard lock(mutex_);
    session_ = std::move(session);
    constraints_ = constraints;
    ready = state_ == session::State::kReady;
  }
  if (ready) adopt_model();  // it was quicker than this call: on_state() found no session to ask
}

void SessionRecord::adopt_model() {
  std::shared_ptr<session::BodySession> session;
  {
    const std::lock_guard lock(mutex_);
    session = session_;
  }
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
  if (newest && geometry)
    streams_->note(std::make_shared<BodyFrames>(newest, geometry, opened_.length_unit));
}

std::shared_ptr<session::BodySession> SessionRecord::session() const {
  const std::lock_guard lock(mutex_);
  if (!session_) throw closed();
  return session_;
}

void SessionRecord::close_session() {
  session()->close();
  std::shared_ptr<session::BodySession> gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  gone = std::exchange(session_, nullptr);
}

std::shared_ptr<const FrameSource> SessionRecord::frames(bool final_only) const {
  const auto session = this->session();
  auto geometry = geometry_of(*session);
  auto result = final_only ? session->final_result() : session->newest_result();
  if (!result) throw Error(ErrorCode::kFailedPrecondition, "session", "there is no result yet");
  return std::make_shared<BodyFrames>(std::move(result), std::move(geometry), opened_.length_unit);
}

proto::GetGeometryResponse SessionRecord::geometry(const std::string& known_basis_hash) const {
  return encode_geometry(*geometry_of(*session()), known_basis_hash);
}

void SessionRecord::describe(proto::SessionStatus& status) const {
  status.set_nodes(static_cast<std::uint32_t>(opened_.nodes));
  status.set_tets(static_cast<std::uint32_t>(opened_.tets));
  status.set_frames(static_cast<std::uint32_t>(opened_.frames));
  std::shared_ptr<session::BodySession> session;
  {
    const std::lock_guard lock(mutex_);
    session = session_;
    status.set_constraints(static_cast<std::uint32_t>(constraints_));
    if (model_) *status.mutable_model() = *model_;
  }
  if (session) status.set_revision(session->revision());
}

void SessionRecord::constraints_changed(std::size_t count) {
  const std::lock_guard lock(mutex_);
  constraints_ = count;
}

void SessionRecord::demand_memory(std::size_t constraints, std::size_t keyframes) const {
  const std::uint64_t limit = hub_.options.limits.session_bytes;
  const std::uint64_t bytes =
      opened_.bytes + estimate_constraint_bytes(constraints, opened_.lanes) +
      estimate_keyframe_bytes(keyframes, opened_.keyframe_rows, constraints, opened_.lanes) +
      estimate_pose_bytes(keyframes, opened_.nodes);
  if (bytes > limit) {
    throw limit_exceeded(
        "edits",
        fmt::format("estimated bytes of the session with {} constraints{}", constraints,
                    keyframes > 0 ? fmt::format(" and {} keyframes", keyframes) : ""),
        limit, bytes);
  }
}

std::size_t SessionRecord::constraint_count() const {
  const std::lock_guard lock(mutex_);
  return constraints_;
}

void SessionRecord::expect_cold(JobId job) {
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
void SessionRecord::take_ended_jobs(std::vector<JobId>& jobs) {
  if (later_job_ && newest_->cold_request >= *later_job_)
    jobs.push_back(*std::exchange(later_job_, std::nullopt));
}

void SessionRecord::on_result(const std::shared_ptr<const session::BodyResult>& result) {
  note_result(
      std::make_shared<proto::ResultInfo>(encode_result(*result, opened_.length_unit)),
      [&]() -> std::shared_ptr<const FrameSource> {
        newest_ = result;
        if (!geometry_) return nullptr;
        return std::make_shared<BodyFrames>(result, geometry_, opened_.length_unit);
      },
      result->check == session::Check::kPending ? ResultWaiters::Check::kPending
                                                : ResultWaiters::Check::kDone);
}

}  // namespace limber::server
