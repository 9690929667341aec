#include "server/kinds/bodies/material.h"

#include "server/wire/arrays.h"

namespace limber::server {

void encode_modes(const spacetime::ModeDynamics& dynamics, double frames_per_second,
                  google::protobuf::RepeatedPtrField<proto::ModeDynamics>& modes) {
  for (Eigen::Index k = 0; k < dynamics.stiffness.size(); ++k) {
    const double stiffness = dynamics.stiffness[k], damping = dynamics.damping[k];
    const auto response = spacetime::mode_response(stiffness, damping, frames_per_second);
    auto& mode = *modes.Add();
    mode.set_frequency_hz(response.frequency_hz);
    mode.set_damping_ratio(response.damping_ratio);
    mode.set_decay_per_s(response.decay_per_s);
    mode.set_stiffness(stiffness);
    mode.set_damping(damping);
  }
}

proto::GetMaterialResponse encode_fitted_material(const session::BodyResult& result,
                                                  double frames_per_second) {
  proto::GetMaterialResponse response;
  if (!result.material) return response;
  encode_modes(result.material->dynamics, frames_per_second, *response.mutable_modes());
  encode_modes(result.initial_material->dynamics, frames_per_second, *response.mutable_initial());
  *response.mutable_mixing() = encode_matrix(result.material->mixing);
  return response;
}

}  // namespace limber::server
