#include "clients/cpp/linkages/session.h"

#include <cstddef>
#include <utility>

#include "clients/cpp/opening.h"

namespace limber::client {

LinkageSession::LinkageSession(Client& client, std::string session, Naming naming)
    : OpenSession(client, std::move(session), naming) {}

LinkageSession LinkageSession::open(Client& client, const v1::Scene& scene,
                                    const std::string& session, Milliseconds timeout) {
  return {client, open_session(client, scene, session, timeout)};
}

v1::LinkageConditions LinkageSession::conditions() { return scene().linkage().conditions(); }

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

v1::EditResponse LinkageSession::add_target(const v1::LinkageTarget& target) {
  v1::Edit change;
  *change.mutable_add_target()->mutable_target() = target;
  return edit({change});
}

std::uint64_t LinkageSession::attach(const v1::LinkageTarget& target) {
  const v1::EditResponse response = add_target(target);
  if (response.target_ids_size() != 1)
    throw ClientError(v1::ERROR_CODE_MALFORMED, "target_ids", "the target has no id");
  return response.target_ids(0);
}

std::uint64_t LinkageSession::attach(unsigned joint, const Vector& position, double stiffness) {
  v1::LinkageTarget target;
  target.set_joint(joint);
  *target.mutable_position() = message(position);
  target.set_stiffness(stiffness);
  return attach(target);
}

std::uint64_t LinkageSession::attach_segment(unsigned segment, double share, const Vector& position,
                                             double stiffness) {
  v1::LinkageTarget target;
  target.mutable_segment()->set_segment(segment);
  target.mutable_segment()->set_share(share);
  *target.mutable_position() = message(position);
  target.set_stiffness(stiffness);
  return attach(target);
}

v1::EditResponse LinkageSession::move_target(std::uint64_t target, const Vector& position) {
  v1::Edit change;
  change.mutable_move_target()->set_id(target);
  *change.mutable_move_target()->mutable_position() = message(position);
  return edit({change});
}

v1::EditResponse LinkageSession::remove_target(std::uint64_t target) {
  return remove_targets({target});
}

v1::EditResponse LinkageSession::remove_targets(const std::vector<std::uint64_t>& targets) {
  std::vector<v1::Edit> changes(targets.size());
  for (std::size_t i = 0; i < targets.size(); ++i)
    changes[i].mutable_remove_target()->set_id(targets[i]);
  return edit(changes);
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

const LinkageGeometry& LinkageSession::geometry() {
  if (!geometry_) geometry_.emplace(geometry_message());
  return *geometry_;
}

std::vector<LinkageShape> LinkageSession::shapes() {
  const v1::Frames newest = frames();
  if (geometry_ && geometry_->hash() != newest.basis_hash()) geometry_.reset();
  return geometry().shapes(newest);
}

LinkageShape LinkageSession::shape() {
  std::vector<LinkageShape> all = shapes();
  if (all.empty()) throw ClientError(v1::ERROR_CODE_MALFORMED, "", "a result without a shape");
  return std::move(all.back());
}

Positions LinkageSession::positions() {
  return decode(frames({.encoding = v1::ENCODING_POSITIONS}), nullptr);
}

std::vector<v1::LinkageStep> events(const v1::ResultInfo& result) {
  std::vector<v1::LinkageStep> found;
  for (const v1::LinkageStep& step : result.linkage().path())
    if (step.event() != v1::BRANCH_EVENT_UNSPECIFIED) found.push_back(step);
  return found;
}

}  // namespace limber::client
