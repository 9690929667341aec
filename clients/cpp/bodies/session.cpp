#include "clients/cpp/bodies/session.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <utility>

#include "clients/cpp/array_numbers.h"
#include "clients/cpp/opening.h"

namespace limber::client {

BodySession::BodySession(Client& client, std::string session, Naming naming)
    : OpenSession(client, std::move(session), naming) {}

BodySession BodySession::open(Client& client, const v1::Scene& scene, const std::string& session,
                              Milliseconds timeout) {
  return {client, open_session(client, scene, session, timeout)};
}

std::vector<v1::Constraint> BodySession::constraints() {
  const v1::Scene now = scene();
  return {now.constraints().begin(), now.constraints().end()};
}

std::vector<v1::Keyframe> BodySession::keyframes() {
  const v1::Scene now = scene();
  return {now.keyframes().begin(), now.keyframes().end()};
}

v1::EditResponse BodySession::add(const v1::Constraint& constraint) {
  v1::Edit change;
  *change.mutable_add()->mutable_constraint() = constraint;
  return edit({change});
}

v1::EditResponse BodySession::replace(const v1::Constraint& constraint) {
  v1::Edit change;
  *change.mutable_replace()->mutable_constraint() = constraint;
  return edit({change});
}

v1::EditResponse BodySession::move(std::uint64_t constraint, const Vector& target) {
  v1::Edit change;
  change.mutable_move()->set_id(constraint);
  *change.mutable_move()->mutable_target() = message(target);
  return edit({change});
}

v1::EditResponse BodySession::remove(const std::vector<std::uint64_t>& constraints) {
  std::vector<v1::Edit> changes(constraints.size());
  for (std::size_t i = 0; i < constraints.size(); ++i)
    changes[i].mutable_remove()->set_id(constraints[i]);
  return edit(changes);
}

v1::EditResponse BodySession::ends(v1::EndCondition first, v1::EndCondition last) {
  v1::Edit change;
  change.mutable_set_ends()->set_first_end(first);
  change.mutable_set_ends()->set_last_end(last);
  return edit({change});
}

v1::EditResponse BodySession::dynamics(const DynamicsChange& change) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::min(client().options().timeout, Milliseconds{10000});
  while (true) {
    const v1::GetSessionResponse now = status_and_scene();
    v1::Edit whole;
    v1::Dynamics& dynamics = *whole.mutable_set_dynamics();
    dynamics = now.scene().dynamics();
    if (change.frames_per_second) dynamics.set_frames_per_second(*change.frames_per_second);
    if (change.period_frames) dynamics.set_period_frames(*change.period_frames);
    if (change.damping_ratio) dynamics.set_damping_ratio(*change.damping_ratio);
    if (change.discretisation) dynamics.set_discretisation(*change.discretisation);
    if (change.force_smoothing) dynamics.set_force_smoothing(*change.force_smoothing);
    if (change.inertia) dynamics.set_inertia(*change.inertia);
    try {
      return edit({whole}, now.status().revision());
    } catch (const ClientError& error) {
      if (error.field() != "expected_revision" || Clock::now() > deadline) throw;
    }
  }
}

v1::EditResponse BodySession::move_pins(const v1::Array& positions) {
  v1::Edit change;
  v1::SetPins& pins = *change.mutable_set_pins();
  if (positions.shape_size() > 0) *pins.mutable_pins() = positions;
  return edit({change});
}

v1::EditResponse BodySession::add_keyframe(const v1::Keyframe& keyframe) {
  v1::Edit change;
  *change.mutable_add_keyframe()->mutable_keyframe() = keyframe;
  return edit({change});
}

v1::EditResponse BodySession::move_keyframe(std::uint64_t keyframe, const KeyframeMove& move) {
  v1::Edit change;
  v1::MoveKeyframe& wanted = *change.mutable_move_keyframe();
  wanted.set_id(keyframe);
  if (move.frame) wanted.set_frame(*move.frame);
  if (move.is_exact) wanted.set_exact(true);
  if (move.weight) wanted.set_weight(*move.weight);
  return edit({change});
}

v1::EditResponse BodySession::remove_keyframes(const std::vector<std::uint64_t>& keyframes) {
  std::vector<v1::Edit> changes(keyframes.size());
  for (std::size_t i = 0; i < keyframes.size(); ++i)
    changes[i].mutable_remove_keyframe()->set_id(keyframes[i]);
  return edit(changes);
}

v1::EditResponse BodySession::optimise(v1::MaterialVariables variables, FittedMaterial fitted) {
  std::vector<v1::Edit> changes;
  if (fitted == FittedMaterial::kForgotten) changes.emplace_back().mutable_reset_material();
  changes.emplace_back().mutable_set_material()->set_variables(variables);
  return edit(changes);
}

v1::EditResponse BodySession::reset_material() {
  v1::Edit change;
  change.mutable_reset_material();
  return edit({change});
}

v1::GetMaterialResponse BodySession::material() {
  return client().call(request<v1::GetMaterialRequest>());
}

Positions BodySession::positions() {
  const v1::Frames newest = frames();
  if (!geometry_ || geometry_->basis_hash() != newest.basis_hash())
    geometry_ = geometry_message(newest.basis_hash());
  return decode(newest, &*geometry_);
}

v1::GetGeometryResponse BodySession::geometry_with_surface() {
  auto wanted = request<v1::GetGeometryRequest>();
  wanted.set_with_surface(true);
  return client().call(wanted);
}

std::vector<double> BodySession::positions_in(std::uint32_t frame, v1::Encoding encoding) {
  FrameOptions options;
  options.encoding = encoding;
  options.first = frame;
  options.count = 1;
  return decode(frames(options), nullptr).values;
}

DrawnSurface BodySession::surface(std::optional<std::uint32_t> frame, v1::PointSurface surface) {
  const v1::GetGeometryResponse geometry = geometry_with_surface();
  if (surface == v1::POINT_SURFACE_CARRIED && !geometry.has_carried_surface()) {
    throw ClientError(v1::ERROR_CODE_FAILED_PRECONDITION, "surface",
                      "the session's scene names no surface");
  }
  const bool is_carried = geometry.has_carried_surface() && surface != v1::POINT_SURFACE_MESH;
  const v1::CarriedSurface& carried = geometry.carried_surface();
  DrawnSurface drawn;
  drawn.surface = is_carried ? v1::POINT_SURFACE_CARRIED : v1::POINT_SURFACE_MESH;
  drawn.triangles = numbers<std::int32_t>(is_carried ? carried.triangles() : geometry.surface(),
                                          v1::DATA_TYPE_INT32, 2, "triangles");
  drawn.vertices =
      frame ? positions_in(*frame, is_carried ? v1::ENCODING_SURFACE : v1::ENCODING_POSITIONS)
            : real_numbers(is_carried ? carried.vertices() : geometry.rest(), 2, "vertices");
  for (const std::int32_t vertex : drawn.triangles) {
    if (vertex < 0 || static_cast<std::size_t>(vertex) >= drawn.vertices.size() / 3)
      throw ClientError(v1::ERROR_CODE_MALFORMED, "", "a triangle has a corner that is no vertex");
  }
  return drawn;
}

PickedPoint BodySession::nearest_surface_point(const Vector& position,
                                               std::optional<std::uint32_t> frame,
                                               v1::PointSurface which) {
  return nearest_point(surface(frame, which), position);
}

std::vector<std::uint32_t> BodySession::nodes_in_box(const Vector& low, const Vector& high,
                                                     std::optional<std::uint32_t> frame) {
  const v1::GetGeometryResponse geometry = geometry_message();
  const auto positions = frame ? positions_in(*frame, v1::ENCODING_POSITIONS)
                               : real_numbers(geometry.rest(), 2, "rest");
  std::vector<char> is_used(positions.size() / 3, 0);
  for (const auto node : numbers<std::int32_t>(geometry.tets(), v1::DATA_TYPE_INT32, 2, "tets"))
    is_used.at(static_cast<std::size_t>(node)) = 1;
  std::vector<std::uint32_t> nodes = points_in_box(positions, low, high);
  std::erase_if(nodes, [&](std::uint32_t node) { return is_used[node] == 0; });
  return nodes;
}

std::uint64_t BodySession::solve_cold() {
  return client().call(request<v1::SolveColdRequest>()).job();
}

void BodySession::look_at(std::uint32_t first_frame, std::uint32_t frame_count) {
  auto message = request<v1::LookAtRequest>();
  message.set_first_frame(first_frame);
  message.set_frame_count(frame_count);
  client().call(message);
}

}  // namespace limber::client
