#include "clients/cpp/beams/session.h"

#include <utility>

#include "clients/cpp/opening.h"

namespace limber::client {

namespace {

v1::BeamLoad load_message(unsigned node, const Vector& force, const Vector& moment) {
  v1::BeamLoad load;
  load.set_node(node);
  *load.mutable_force() = message(force);
  *load.mutable_moment() = message(moment);
  return load;
}

}  // namespace

BeamSession::BeamSession(Client& client, std::string session, Naming naming)
    : OpenSession(client, std::move(session), naming) {}

BeamSession BeamSession::open(Client& client, const v1::Scene& scene, const std::string& session,
                              Milliseconds timeout) {
  return {client, open_session(client, scene, session, timeout)};
}

v1::BeamStructure BeamSession::structure() { return scene().beams().structure(); }

v1::EditResponse BeamSession::move_support(unsigned node, const BeamMove& move) {
  v1::Edit change;
  v1::MoveBeamNode& wanted = *change.mutable_move_beam_node();
  v1::BeamMotion& motion = *wanted.mutable_motion();
  motion.set_node(node);
  if (move.x) motion.set_x(*move.x);
  if (move.y) motion.set_y(*move.y);
  if (move.z) motion.set_z(*move.z);
  if (move.position) *wanted.mutable_position() = message(*move.position);
  if (move.rotation) *motion.mutable_rotation() = message(*move.rotation);
  if (move.rotation_x) motion.set_rotation_x(*move.rotation_x);
  if (move.rotation_y) motion.set_rotation_y(*move.rotation_y);
  if (move.rotation_z) motion.set_rotation_z(*move.rotation_z);
  if (move.axes) {
    *motion.mutable_x_axis() = message((*move.axes)[0]);
    *motion.mutable_y_axis() = message((*move.axes)[1]);
  }
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

v1::EditResponse BeamSession::load(unsigned node, const Vector& force, const Vector& moment,
                                   LoadDirection direction) {
  v1::Edit change;
  auto& load = *change.mutable_set_beam_load()->mutable_load();
  load = load_message(node, force, moment);
  load.set_follows(direction == LoadDirection::kFollows);
  return edit({change});
}

v1::EditResponse BeamSession::push(unsigned node, const Vector& force, const Vector& moment) {
  v1::Edit change;
  *change.mutable_push_beam_node()->mutable_load() = load_message(node, force, moment);
  return edit({change});
}

v1::EditResponse BeamSession::element_load(unsigned element, const Vector& force,
                                           LoadDirection direction) {
  v1::Edit change;
  auto& load = *change.mutable_set_beam_element_load()->mutable_load();
  load.set_element(element);
  *load.mutable_force() = message(force);
  load.set_follows(direction == LoadDirection::kFollows);
  return edit({change});
}

Positions BeamSession::positions() { return decode(frames(v1::ENCODING_POSITIONS), nullptr); }

v1::BeamSolution BeamSession::solution() {
  return client().call(request<v1::GetBeamSolutionRequest>(), large(client())).solution();
}

}  // namespace limber::client
