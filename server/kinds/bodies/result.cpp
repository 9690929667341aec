#include "server/kinds/bodies/result.h"

#include "server/wire/enum_table.h"
#include "server/wire/session_values.h"

namespace limber::server {
namespace {

constexpr EnumTable<spacetime::SolveStatus, proto::SolveStatus> kMotionStatuses{
    {spacetime::SolveStatus::kConverged, proto::SOLVE_STATUS_CONVERGED},
    {spacetime::SolveStatus::kImproved, proto::SOLVE_STATUS_IMPROVED},
    {spacetime::SolveStatus::kIterationLimit, proto::SOLVE_STATUS_ITERATION_LIMIT},
    {spacetime::SolveStatus::kStalled, proto::SOLVE_STATUS_STALLED},
    {spacetime::SolveStatus::kCancelled, proto::SOLVE_STATUS_CANCELLED}};

/// A model that was built says which basis was best.
constexpr EnumTable<reduced::BasisKind, proto::Basis> kBasisKinds{
    {reduced::BasisKind::kBest, proto::BASIS_UNSPECIFIED},
    {reduced::BasisKind::kSnapshots, proto::BASIS_SNAPSHOTS},
    {reduced::BasisKind::kModalDerivatives, proto::BASIS_MODAL_DERIVATIVES},
    {reduced::BasisKind::kMapDerivatives, proto::BASIS_MAP_DERIVATIVES}};

constexpr EnumTable<session::ModeChoice::State, proto::ModeChoice::State> kChoiceStates{
    {session::ModeChoice::State::kOff, proto::ModeChoice::STATE_UNSPECIFIED},
    {session::ModeChoice::State::kNamed, proto::ModeChoice::STATE_NAMED},
    {session::ModeChoice::State::kUnasked, proto::ModeChoice::STATE_UNASKED},
    {session::ModeChoice::State::kSettled, proto::ModeChoice::STATE_SETTLED},
    {session::ModeChoice::State::kBounded, proto::ModeChoice::STATE_BOUNDED}};

proto::ModeChoice encode_choice(const session::ModeChoice& choice) {
  proto::ModeChoice message;
  message.set_state(kChoiceStates.encode(choice.state));
  message.set_modes(static_cast<std::uint32_t>(choice.modes));
  for (const session::ModeEnergy& one : choice.energies) {
    auto* energy = message.add_energies();
    energy->set_modes(static_cast<std::uint32_t>(one.modes));
    energy->set_energy(one.energy);
  }
  message.set_reason(choice.reason);
  if (choice.saving) message.set_saving(*choice.saving);
  message.set_fewer(static_cast<std::uint32_t>(choice.fewer));
  return message;
}

/// [m/frame] to [length unit / s]
double encode_velocity(double velocity, double frames_per_second, double length_unit) {
  return velocity * frames_per_second / length_unit;
}

proto::MotionError encode_motion_error(const session::MotionCheck& check, double length_unit) {
  const reduced::MotionError& error = check.error;
  proto::MotionError message;
  message.set_shape_error(error.shape_error);
  message.set_worst_frame_error(error.worst_frame_error);
  message.set_worst_frame(static_cast<std::uint32_t>(error.worst_frame));
  message.set_max_distance(error.max_distance / length_unit);
  message.set_max_distance_share(error.max_distance / check.length);
  message.set_max_constraint_error(error.max_constraint_error / length_unit);
  message.set_max_velocity_error(
      encode_velocity(error.max_velocity_error, check.frames_per_second, length_unit));
  message.set_inverted_tets(static_cast<std::uint32_t>(error.inverted_tets));
  message.set_inverted_frame(static_cast<std::uint32_t>(error.inverted_frame));
  message.set_frames(static_cast<std::uint32_t>(error.frames));
  message.set_tolerance(check.tolerance);
  message.set_within_tolerance(check.within_tolerance());
  message.set_check_ms(check.check_ms);
  message.set_zigzag(check.shaking.zigzag / length_unit);
  message.set_zigzag_share(check.shaking.zigzag / check.length);
  message.set_zigzag_frame(static_cast<std::uint32_t>(check.shaking.frame));
  return message;
}

}  // namespace

proto::ResultInfo encode_result(const session::BodyResult& result, double length_unit) {
  proto::ResultInfo info = encode_header(result);
  const auto& report = result.report;
  info.set_status(kMotionStatuses.encode(report.status));
  info.set_iterations(static_cast<std::uint32_t>(report.iterations));
  info.set_force_energy(report.force_energy);
  info.set_constraint_energy(report.constraint_energy);
  info.set_total_energy(report.total_energy);
  info.set_gradient(report.gradient);
  info.set_max_constraint_error(report.max_constraint_error / length_unit);
  info.set_rms_constraint_error(report.rms_constraint_error / length_unit);
  info.set_rank_deficient(report.rank_deficient);
  info.set_message(report.message);
  info.set_max_exact_error(report.max_exact_error / length_unit);
  info.set_max_velocity_error(
      encode_velocity(report.max_velocity_error, result.frames_per_second, length_unit));
  info.set_exact(result.is_exact);
  info.set_first_picture(result.is_first_picture);
  info.set_max_exact_velocity_error(
      encode_velocity(report.max_exact_velocity_error, result.frames_per_second, length_unit));
  info.set_material_iterations(static_cast<std::uint32_t>(result.material_iterations));
  info.set_column_energy(result.column_energy);
  info.set_unit_force_energy(result.unit_force_energy);
  info.set_max_keyframe_error(result.max_keyframe_error / length_unit);
  info.set_weight_scale(result.weight_scale);
  for (const spacetime::ConstraintMiss& miss : result.out_of_reach) {
    auto& message = *info.add_out_of_reach();
    message.set_constraint(miss.id);
    message.set_distance(miss.distance / length_unit);
  }
  if (result.starts) {
    auto& starts = *info.mutable_starts();
    starts.set_compared(static_cast<std::uint32_t>(result.starts->compared));
    starts.set_optima(static_cast<std::uint32_t>(result.starts->optima));
    starts.set_lowest_energy(result.starts->lowest_energy);
    starts.set_highest_energy(result.starts->highest_energy);
    starts.set_largest_distance(result.starts->largest_distance / length_unit);
    starts.set_budget(static_cast<std::uint32_t>(result.starts->budget));
    starts.set_unconverged(static_cast<std::uint32_t>(result.starts->unconverged));
  }
  if (result.high_frequency_share) info.set_high_frequency_share(*result.high_frequency_share);
  if (result.motion_check)
    *info.mutable_motion_error() = encode_motion_error(*result.motion_check, length_unit);
  return info;
}

proto::ModelInfo encode_model(const session::BodySession& session) {
  proto::ModelInfo info;
  const auto built = session.model();
  if (!built) return info;
  const reduced::ReducedModel& model = *built;
  info.set_modes(static_cast<std::uint32_t>(model.coordinate_count()));
  info.set_basis_size(static_cast<std::uint32_t>(model.basis_size()));
  info.set_cubature_size(static_cast<std::uint32_t>(model.cubature_size()));
  info.set_error_mean(model.report.error_mean);
  info.set_error_max(model.report.error_max);
  info.set_met_tolerance(model.report.met_tolerance);
  info.set_message(session.model_message());
  info.set_build_s(session.build_seconds());
  info.set_from_cache(session.model_from_cache());
  info.set_basis(kBasisKinds.encode(model.report.basis));
  info.set_compared_size(static_cast<std::uint32_t>(model.report.compared_size));
  if (model.report.snapshot_basis_error)
    info.set_snapshot_basis_error(*model.report.snapshot_basis_error);
  if (model.report.derivative_basis_error)
    info.set_derivative_basis_error(*model.report.derivative_basis_error);
  *info.mutable_mode_choice() = encode_choice(session.mode_choice());
  return info;
}

}  // namespace limber::server
