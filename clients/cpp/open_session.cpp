#include "clients/cpp/open_session.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "clients/cpp/files.h"
#include "clients/cpp/opening.h"
#include "clients/cpp/part_size.h"

namespace limber::client {

v1::Vector3 message(const Vector& vector) {
  v1::Vector3 result;
  result.set_x(vector[0]);
  result.set_y(vector[1]);
  result.set_z(vector[2]);
  return result;
}

OpenSession::OpenSession(Client& client, std::string session, Naming naming)
    : client_(&client), session_(client, std::move(session), naming) {}

v1::SessionStatus OpenSession::status() {
  v1::SessionStatus status = client_->call(request<v1::GetSessionRequest>()).status();
  revision_ = std::max<std::uint64_t>(revision_, status.revision());
  return status;
}

v1::ExplainResponse OpenSession::explain() { return client_->call(request<v1::ExplainRequest>()); }

v1::JoinSessionResponse OpenSession::join() {
  return client_->call(request<v1::JoinSessionRequest>());
}

v1::LeaveSessionResponse OpenSession::leave() {
  return client_->call(request<v1::LeaveSessionRequest>());
}

v1::EditResponse OpenSession::edit(const std::vector<v1::Edit>& edits,
                                   std::optional<std::uint64_t> expected_revision) {
  auto wanted = request<v1::EditRequest>();
  if (expected_revision) wanted.set_expected_revision(*expected_revision);
  for (const v1::Edit& edit : edits) *wanted.add_edits() = edit;
  v1::EditResponse response = client_->call(wanted);
  revision_ = std::max<std::uint64_t>(revision_, response.revision());
  return response;
}

v1::EditResponse OpenSession::gravity(const Vector& acceleration) {
  v1::Edit change;
  *change.mutable_set_gravity()->mutable_gravity() = message(acceleration);
  return edit({change});
}

v1::EditResponse OpenSession::undo(Whose whose) {
  v1::Edit change;
  change.mutable_undo()->set_anyone(whose == Whose::kAnyone);
  return edit({change});
}

v1::EditResponse OpenSession::redo(Whose whose) {
  v1::Edit change;
  change.mutable_redo()->set_anyone(whose == Whose::kAnyone);
  return edit({change});
}

v1::ResultInfo OpenSession::wait(Milliseconds timeout) {
  WaitOptions options;
  options.timeout = timeout;
  return wait(options);
}

v1::ResultInfo OpenSession::wait(const WaitOptions& options) {
  auto wanted = request<v1::WaitRequest>();
  wanted.set_revision(options.revision.value_or(revision_));
  wanted.set_until(options.until);
  return wait_for_result(*client_, std::move(wanted), options.timeout, options.progress);
}

v1::ResultInfo OpenSession::wait_checked(Milliseconds timeout) {
  WaitOptions options;
  options.until = v1::WaitRequest::UNTIL_CHECKED;
  options.timeout = timeout;
  return wait(options);
}

v1::CancelResponse OpenSession::cancel() { return client_->call(request<v1::CancelRequest>()); }

v1::CloseSessionResponse OpenSession::close(std::optional<Milliseconds> timeout) {
  return client_->call(request<v1::CloseSessionRequest>(), timeout.value_or(large(*client_)));
}

v1::Scene OpenSession::scene() { return std::move(*status_and_scene().mutable_scene()); }

v1::GetSessionResponse OpenSession::status_and_scene() {
  auto wanted = request<v1::GetSessionRequest>();
  wanted.set_with_scene(true);
  return client_->call(wanted, large(*client_));
}

v1::Frames OpenSession::frames(const FrameOptions& options) {
  constexpr int kTries = 3;  // newer results may displace the one whose parts are fetched
  auto wanted = request<v1::GetFramesRequest>();
  wanted.set_encoding(options.encoding);
  wanted.set_first_frame(options.first);
  wanted.set_frame_count(options.count);
  wanted.set_final_only(options.final_only);
  // Parts of quantised positions would have boxes of their own.
  const bool is_divisible = options.encoding != v1::ENCODING_POSITIONS_QUANTISED;
  for (int i = 0; is_divisible && i < kTries; ++i) {
    try {
      return frames_in_parts(wanted);
    } catch (const ClientError& error) {
      // An older server refuses a field of the request that it does not know: that the answer can
      // come in parts.
      if (error.code() == v1::ERROR_CODE_INVALID_ARGUMENT && error.field() == "get_frames") break;
      if (error.field() != "result_sequence") throw;
    }
  }
  return client_->call(wanted, large(*client_)).frames();
}

v1::Frames OpenSession::frames_in_parts(v1::GetFramesRequest wanted) {
  PartSize size;
  const auto next_part = [&] {
    wanted.set_most_bytes(size.bytes());
    const auto begin = std::chrono::steady_clock::now();
    v1::GetFramesResponse answer = client_->call(wanted, large(*client_));
    size.note(std::chrono::steady_clock::now() - begin);
    return answer;
  };
  v1::GetFramesResponse answer = next_part();
  v1::Frames frames = std::move(*answer.mutable_frames());
  while (answer.frames_left() > 0) {
    wanted.set_result_sequence(frames.result().sequence());
    wanted.set_first_frame(frames.first_frame() + frames.frame_count());
    wanted.set_frame_count(answer.frames_left());
    answer = next_part();
    const v1::Frames& part = answer.frames();
    if (part.frame_count() == 0 || frames.data().shape_size() == 0)
      throw ClientError(v1::ERROR_CODE_MALFORMED, "frames", "a part of a motion has no frames");
    frames.set_frame_count(frames.frame_count() + part.frame_count());
    frames.mutable_data()->set_shape(0, frames.frame_count());
    frames.mutable_data()->mutable_data()->append(part.data().data());
  }
  return frames;
}

v1::GetGeometryResponse OpenSession::geometry_message(const std::string& basis_hash) {
  auto wanted = request<v1::GetGeometryRequest>();
  wanted.set_basis_hash(basis_hash);
  return client_->call(wanted, large(*client_));
}

std::set<std::string> OpenSession::export_files(v1::ExportFormat format,
                                                const std::filesystem::path& folder,
                                                const std::string& stem,
                                                const ExportProgress& progress) {
  std::set<std::string> written;
  auto wanted = request<v1::ExportRequest>();
  wanted.set_format(format);
  wanted.set_stem(stem);
  unsigned count = 1;
  for (unsigned part = 0; part < count; ++part) {
    wanted.set_part(part);
    const v1::ExportResponse response = client_->call(wanted, large(*client_));
    count = response.part_count();
    wanted.set_result_sequence(response.result().sequence());
    for (const v1::ExportedFile& file : response.files())
      written.insert(write_exported(folder, file).string());
    if (progress) progress(part + 1, count);
  }
  return written;
}

}  // namespace limber::client
