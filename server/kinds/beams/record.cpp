#include "server/kinds/beams/record.h"

#include <utility>

#include "server/kinds/beams/result.h"

namespace limber::server {

BeamRecord::BeamRecord(Hub& hub, SessionKey key, DecodedBeams opened, JobId open_job)
    : Record(hub, std::move(key), opened.name, open_job), opened_(std::move(opened)) {}

void BeamRecord::attach(std::shared_ptr<session::BeamSession> session) {
  const std::lock_guard lock(mutex_);
  session_ = std::move(session);
}

std::shared_ptr<session::BeamSession> BeamRecord::session() const {
  const std::lock_guard lock(mutex_);
  if (!session_) throw closed();
  return session_;
}

void BeamRecord::close_session() {
  session()->close();
  std::shared_ptr<session::BeamSession> gone;  // freed without the lock
  const std::lock_guard lock(mutex_);
  gone = std::exchange(session_, nullptr);
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
  std::shared_ptr<session::BeamSession> session;
  {
    const std::lock_guard lock(mutex_);
    session = session_;
  }
  if (session) status.set_revision(session->revision());
}

void BeamRecord::on_result(const std::shared_ptr<const session::BeamResult>& result) {
  note_result(std::make_shared<proto::ResultInfo>(encode_beam_result(*result)),
              [&] { return std::make_shared<BeamFrames>(result); });
}

}  // namespace limber::server
