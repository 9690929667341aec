#include "clients/cpp/beam_session.h"

#include <algorithm>
#include <utility>

#include "clients/cpp/opening.h"

namespace limber::client {
namespace {

v1::Vector3 message(const BeamSession::Vector& vector) {
  v1::Vector3 result;
  result.set_x(vector[0]);
  result.set_y(vector[1]);
  result.set_z(vector[2]);
  return result;
}

}  // namespace

BeamSession::BeamSession(Client& client, std::string session)
    : client_(&client), session_(std::move(session)) {}

BeamSession BeamSession::open(Client& client, const v1::Scene& scene, const std::string& session,
                              Milliseconds timeout) {
  return {client, open_session(client, scene, session, timeout)};
}

v1::SessionStatus BeamSession::status() {
  v1::GetSessionRequest request;
  request.set_session(session_);
  v1::SessionStatus status = client_->call(request).status();
  revision_ = std::max<std::uint64_t>(revision_, status.revision());
  return status;
}

v1::BeamStructure BeamSession::structure() {
  v1::GetSessionRequest request;
  request.set_session(session_);
  request.set_with_scene(true);
  return client_->call(request, large(*client_)).scene().beams().structure();
}

v1::EditResponse BeamSession::edit(const std::vector<v1::Edit>& edits) {
  v1::EditRequest request;
  request.set_session(session_);
  for (const v1::Edit& edit : edits) *request.add_edits() = edit;
  v1::EditResponse response = client_->call(request);
  revision_ = std::max<std::uint64_t>(revision_, response.revision());
  return response;
}

v1::EditResponse BeamSession::move_support(unsigned node, const BeamMove& move) {
  v1::Edit change;
  auto& motion = *change.mutable_move_beam_node()->mutable_motion();
  motion.set_node(node);
  if (move.x) motion.set_x(*move.x);
  if (move.y) motion.set_y(*move.y);
  if (move.z) motion.set_z(*move.z);
  if (move.rotation) *motion.mutable_rotation() = message(*move.rotation);
  return edit({change});
}

v1::EditResponse BeamSession::support(const v1::BeamSupport& support) {
  v1::Edit change;
  *change.mutable_set_beam_support()->mutable_support() = support;
  return edit({change});
}

v1::EditResponse BeamSession::hold(unsigned node) {
  v1::Edit change;
  change.mutable_hold_beam_node()->set_node(node);
  return edit({change});
}

v1::EditResponse BeamSession::release(unsigned node) {
  v1::Edit change;
  change.mutable_release_beam_node()->set_node(node);
  return edit({change});
}

v1::EditResponse BeamSession::load(unsigned node, const Vector& force, const Vector& moment) {
  v1::Edit change;
  auto& load = *change.mutable_set_beam_load()->mutable_load();
  load.set_node(node);
  *load.mutable_force() = message(force);
  *load.mutable_moment() = message(moment);
  return edit({change});
}

v1::EditResponse BeamSession::element_load(unsigned element, const Vector& force) {
  v1::Edit change;
  auto& load = *change.mutable_set_beam_element_load()->mutable_load();
  load.set_element(element);
  *load.mutable_force() = message(force);
  return edit({change});
}

v1::EditResponse BeamSession::gravity(const Vector& acceleration) {
  v1::Edit change;
  *change.mutable_set_gravity()->mutable_gravity() = message(acceleration);
  return edit({change});
}

v1::EditResponse BeamSession::undo() {
  v1::Edit change;
  change.mutable_undo();
  return edit({change});
}

v1::EditResponse BeamSession::redo() {
  v1::Edit change;
  change.mutable_redo();
  return edit({change});
}

v1::ResultInfo BeamSession::wait(Milliseconds timeout) {
  return wait_final(*client_, session_, revision_, timeout);
}

Positions BeamSession::positions() {
  v1::GetFramesRequest request;
  request.set_session(session_);
  request.set_encoding(v1::ENCODING_POSITIONS);
  return decode(client_->call(request, large(*client_)).frames(), nullptr);
}

v1::BeamSolution BeamSession::solution() {
  v1::GetBeamSolutionRequest request;
  request.set_session(session_);
  return client_->call(request, large(*client_)).solution();
}

void BeamSession::cancel() {
  v1::CancelRequest request;
  request.set_session(session_);
  client_->call(request);
}

void BeamSession::close() {
  v1::CloseSessionRequest request;
  request.set_session(session_);
  client_->call(request, large(*client_));
}

}  // namespace limber::client
