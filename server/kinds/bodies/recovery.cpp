#include "server/kinds/bodies/recovery.h"

#include "engine/session/bodies/problem_mapping.h"
#include "server/kinds/bodies/material.h"
#include "server/kinds/bodies/scene.h"
#include "server/wire/arrays.h"
#include "server/wire/indices.h"

namespace limber::server {

session::RecoveryRequest decode_recovery(const proto::RecoverRequest& message) {
  session::RecoveryRequest request;
  if (message.variables() != proto::MATERIAL_VARIABLES_UNSPECIFIED)
    request.variables = session::map_variables(decode_variables(message.variables()));
  request.recovered_frames = decode_index(message.recovered_frames(), "recovered_frames");
  request.driven_frames = decode_index(message.driven_frames(), "driven_frames");
  request.total_frames = decode_index(message.total_frames(), "total_frames");
  if (message.has_weight()) request.weight = message.weight();
  if (message.has_column_weight()) request.column_weight = message.column_weight();
  if (message.start() == proto::RECOVERY_START_SPECTRUM)
    request.start = spacetime::RecoveryStart::kSpectrum;
  return request;
}

proto::RecoveryReport encode_report(const session::MaterialRecovery& recovery) {
  const session::RecoveryReport& report = recovery.report;
  proto::RecoveryReport message;
  message.set_recovered_frames(static_cast<std::uint32_t>(report.recovered_frames));
  message.set_frames(static_cast<std::uint32_t>(recovery.positions.cols()));
  message.set_frames_per_second(report.frames_per_second);
  encode_modes(report.dynamics, report.frames_per_second, *message.mutable_modes());
  *message.mutable_mixing() = encode_matrix(report.mixing);
  message.set_converged(report.converged);
  message.set_steps(static_cast<std::uint32_t>(report.steps));
  message.set_force_energy(report.energies.force);
  message.set_constraint_energy(report.energies.constraint);
  message.set_projection_error(report.projection_error);
  message.set_recovered_error(report.recovered_error);
  message.set_continued_error(report.continued_error);
  message.set_final_frame_error(report.final_frame_error);
  message.set_message(report.message);
  return message;
}

}  // namespace limber::server
