#include "clients/cpp/linkage_session.h"

#include <algorithm>
#include <utility>

#include "clients/cpp/opening.h"

namespace limber::client {
namespace {

v1::Vector3 message(const Vector& vector) {
  v1::Vector3 result;
  result.set_x(vector[0]);
  result.set_y(vector[1]);
  result.set_z(vector[2]);
  return result;
}

}  // namespace

LinkageSession::LinkageSession(Client& client, std::string session)
    : client_(&client), session_(std::move(session)) {}

LinkageSession LinkageSession::open(Client& client, const v1::Scene& scene,
                                    const std::string& session, Milliseconds timeout) {
  return {client, open_session(client, scene, session, timeout)};
}

v1::SessionStatus LinkageSession::status() {
  v1::GetSessionRequest request;
  request.set_session(session_);
  v1::SessionStatus status = client_->call(request).status();
  revision_ = std::max<std::uint64_t>(revision_, status.revision());
  return status;
}

v1::LinkageConditions LinkageSession::conditions() {
  v1::GetSessionRequest request;
  request.set_session(session_);
  request.set_with_scene(true);
  return client_->call(request).scene().linkage().conditions();
}

v1::EditResponse LinkageSession::edit(const std::vector<v1::Edit>& edits) {
  v1::EditRequest request;
  request.set_session(session_);
  for (const v1::Edit& edit : edits) *request.add_edits() = edit;
  v1::EditResponse response = client_->call(request);
  revision_ = std::max<std::uint64_t>(revision_, response.revision());
  return response;
}

v1::EditResponse LinkageSession::deploy(std::optional<double> angle) {
  v1::Edit change;
  auto& wanted = *change.mutable_set_mean_angle();
  if (angle) wanted.set_angle_degrees(*angle);
  return edit({change});
}

v1::EditResponse LinkageSession::set_angle(unsigned joint, std::optional<double> angle) {
  v1::Edit change;
  auto& wanted = *change.mutable_set_joint_angle();
  wanted.set_joint(joint);
  if (angle) wanted.set_angle_degrees(*angle);
  return edit({change});
}

v1::EditResponse LinkageSession::pin(unsigned joint, v1::Held held,
                                     const std::optional<Vector>& position) {
  v1::Edit change;
  auto& wanted = *change.mutable_pin_joint()->mutable_pin();
  wanted.set_joint(joint);
  wanted.set_held(held);
  if (position) *wanted.mutable_position() = message(*position);
  return edit({change});
}

v1::EditResponse LinkageSession::release(unsigned joint) { return pin(joint, v1::HELD_NOTHING); }

std::uint64_t LinkageSession::add(const v1::Edit& change) {
  const v1::EditResponse response = edit({change});
  if (response.target_ids_size() != 1)
    throw ClientError(v1::ERROR_CODE_MALFORMED, "target_ids", "the target has no id");
  return response.target_ids(0);
}

std::uint64_t LinkageSession::attach(unsigned joint, const Vector& position, double stiffness) {
  v1::Edit change;
  auto& target = *change.mutable_add_target()->mutable_target();
  target.set_joint(joint);
  *target.mutable_position() = message(position);
  target.set_stiffness(stiffness);
  return add(change);
}

std::uint64_t LinkageSession::attach_segment(unsigned segment, double share, const Vector& position,
                                             double stiffness) {
  v1::Edit change;
  auto& target = *change.mutable_add_target()->mutable_target();
  target.mutable_segment()->set_segment(segment);
  target.mutable_segment()->set_share(share);
  *target.mutable_position() = message(position);
  target.set_stiffness(stiffness);
  return add(change);
}

v1::EditResponse LinkageSession::move_target(std::uint64_t target, const Vector& position) {
  v1::Edit change;
  change.mutable_move_target()->set_id(target);
  *change.mutable_move_target()->mutable_position() = message(position);
  return edit({change});
}

v1::EditResponse LinkageSession::remove_target(std::uint64_t target) {
  v1::Edit change;
  change.mutable_remove_target()->set_id(target);
  return edit({change});
}

v1::EditResponse LinkageSession::load(unsigned joint, const JointLoad& load) {
  v1::Edit change;
  auto& wanted = *change.mutable_set_joint_load()->mutable_load();
  wanted.set_joint(joint);
  *wanted.mutable_force() = message(load.force);
  *wanted.mutable_moment() = message(load.moment);
  wanted.set_torque(load.torque);
  return edit({change});
}

v1::EditResponse LinkageSession::gravity(const Vector& acceleration) {
  v1::Edit change;
  *change.mutable_set_gravity()->mutable_gravity() = message(acceleration);
  return edit({change});
}

v1::EditResponse LinkageSession::undo() {
  v1::Edit change;
  change.mutable_undo();
  return edit({change});
}

v1::EditResponse LinkageSession::redo() {
  v1::Edit change;
  change.mutable_redo();
  return edit({change});
}

v1::ResultInfo LinkageSession::wait(Milliseconds timeout) {
  return wait_final(*client_, session_, revision_, timeout);
}

const LinkageGeometry& LinkageSession::geometry() {
  if (!geometry_) {
    v1::GetGeometryRequest request;
    request.set_session(session_);
    geometry_.emplace(client_->call(request, large(*client_)));
  }
  return *geometry_;
}

v1::Frames LinkageSession::frames(v1::Encoding encoding) {
  v1::GetFramesRequest request;
  request.set_session(session_);
  request.set_encoding(encoding);
  return client_->call(request, large(*client_)).frames();
}

std::vector<LinkageShape> LinkageSession::shapes() {
  return geometry().shapes(frames(v1::ENCODING_COORDINATES));
}

LinkageShape LinkageSession::shape() {
  std::vector<LinkageShape> all = shapes();
  if (all.empty()) throw ClientError(v1::ERROR_CODE_MALFORMED, "", "a result without a shape");
  return std::move(all.back());
}

Positions LinkageSession::positions() { return decode(frames(v1::ENCODING_POSITIONS), nullptr); }

void LinkageSession::cancel() {
  v1::CancelRequest request;
  request.set_session(session_);
  client_->call(request);
}

void LinkageSession::close() {
  v1::CloseSessionRequest request;
  request.set_session(session_);
  client_->call(request, large(*client_));
}

std::vector<v1::LinkageStep> events(const v1::ResultInfo& result) {
  std::vector<v1::LinkageStep> found;
  for (const v1::LinkageStep& step : result.linkage().path())
    if (step.event() != v1::BRANCH_EVENT_UNSPECIFIED) found.push_back(step);
  return found;
}

}  // namespace limber::client
