#include "clients/cpp/open_session.h"

#include <algorithm>
#include <utility>

#include "clients/cpp/opening.h"

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

v1::EditResponse OpenSession::undo() {
  v1::Edit change;
  change.mutable_undo();
  return edit({change});
}

v1::EditResponse OpenSession::redo() {
  v1::Edit change;
  change.mutable_redo();
  return edit({change});
}

v1::ResultInfo OpenSession::wait(Milliseconds timeout) {
  return wait_final(*client_, reference(), revision_, timeout);
}

v1::ResultInfo OpenSession::wait(const WaitOptions& options) {
  auto wanted = request<v1::WaitRequest>();
  wanted.set_revision(options.revision.value_or(revision_));
  wanted.set_until(options.until);
  return wait_for_result(*client_, std::move(wanted), options.timeout, options.progress);
}

v1::CancelResponse OpenSession::cancel() { return client_->call(request<v1::CancelRequest>()); }

v1::CloseSessionResponse OpenSession::close() {
  return client_->call(request<v1::CloseSessionRequest>(), large(*client_));
}

v1::Scene OpenSession::scene() {
  auto wanted = request<v1::GetSessionRequest>();
  wanted.set_with_scene(true);
  return client_->call(wanted, large(*client_)).scene();
}

v1::Frames OpenSession::frames(v1::Encoding encoding) {
  auto wanted = request<v1::GetFramesRequest>();
  wanted.set_encoding(encoding);
  return client_->call(wanted, large(*client_)).frames();
}

}  // namespace limber::client
