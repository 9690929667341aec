#include "server/kinds/bodies/material.h"

#include "engine/spacetime/force_rows.h"
#include "server/wire/arrays.h"
#include "server/wire/errors.h"

namespace limber::server {

void encode_modes(const spacetime::ModeDynamics& dynamics, double frames_per_second,
                  google::protobuf::RepeatedPtrField<proto::ModeDynamics>& modes) {
  for (Eigen::Index k = 0; k < dynamics.stiffness.size(); ++k) {
    const double stiffness = dynamics.stiffness[k], damping = dynamics.damping[k];
    const auto response =
        spacetime::mode_response(stiffness, damping, frames_per_second, dynamics.discretisation);
    auto& mode = *modes.Add();
    mode.set_frequency_hz(response.frequency_hz);
    mode.set_damping_ratio(response.damping_ratio);
    mode.set_decay_per_s(response.decay_per_s);
    mode.set_stiffness(stiffness);
    mode.set_damping(damping);
    const spacetime::ForceStencil force = spacetime::force_stencil(dynamics, k);
    mode.set_force_before(force.before);
    mode.set_force_centre(force.centre);
    mode.set_force_next(force.next);
    mode.set_force_share(dynamics.force_weight(k) / dynamics.scale);
  }
}

proto::GetMaterialResponse encode_fitted_material(const session::BodyResult& result,
                                                  double frames_per_second) {
  proto::GetMaterialResponse response;
  if (!result.material) return response;
  encode_modes(result.material->dynamics, frames_per_second, *response.mutable_modes());
  encode_modes(result.initial_material->dynamics, frames_per_second, *response.mutable_initial());
  *response.mutable_mixing() = encode_matrix(result.material->mixing);
  response.set_force_scale(result.material->dynamics.scale);
  response.set_smoothing_frames(result.material->dynamics.smoothing);
  return response;
}

proto::Array encode_coordinates(const session::BodyResult& result) {
  return encode_matrix(result.modal.transpose());
}

void add_candidates(const session::BodySession& session, std::uint64_t message_bytes,
                    proto::GetMaterialResponse& response) {
  const auto model = session.model();
  if (!model) throw Error(ErrorCode::kFailedPrecondition, "session", "the model is not built yet");
  const auto bytes = static_cast<std::uint64_t>(session.unedited()->mesh.nodes.size()) *
                     static_cast<std::uint64_t>(model->coordinate_count()) * sizeof(double);
  if (bytes > message_bytes)
    throw limit_exceeded("with_candidates", "bytes of the candidate modes", message_bytes, bytes);
  const session::CandidateModes candidates = session.candidate_modes();
  if (static_cast<std::uint64_t>(candidates.modes.cols()) != response.mixing().shape(0)) {
    throw Error(ErrorCode::kFailedPrecondition, "session",
                "the session changes its modes just now: ask again");
  }
  auto& modes = *response.mutable_candidates();
  modes = encode_matrix(candidates.modes);
  modes.clear_shape();
  modes.add_shape(static_cast<std::uint64_t>(candidates.modes.rows() / 3));
  modes.add_shape(3);
  modes.add_shape(static_cast<std::uint64_t>(candidates.modes.cols()));
  for (const double frequency : candidates.frequencies)
    response.add_candidate_frequencies_hz(frequency);
}

}  // namespace limber::server
