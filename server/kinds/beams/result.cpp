#include "server/kinds/beams/result.h"

#include <algorithm>

#include "server/kinds/beams/solution.h"
#include "server/wire/arrays.h"
#include "server/wire/enum_table.h"
#include "server/wire/session_values.h"

namespace limber::server {
namespace {

constexpr EnumTable<beams::BeamStatus, proto::SolveStatus> kSolveStatuses{
    {beams::BeamStatus::kConverged, proto::SOLVE_STATUS_CONVERGED},
    {beams::BeamStatus::kStalled, proto::SOLVE_STATUS_STALLED},
    {beams::BeamStatus::kUnstable, proto::SOLVE_STATUS_SADDLE},
    {beams::BeamStatus::kMechanism, proto::SOLVE_STATUS_UNBALANCED},
    {beams::BeamStatus::kIterationLimit, proto::SOLVE_STATUS_ITERATION_LIMIT},
    {beams::BeamStatus::kCancelled, proto::SOLVE_STATUS_CANCELLED}};

void encode_beam_report(const beams::BeamReport& report, proto::BeamInfo& info) {
  info.set_status(encode_beam_status(report.status));
  info.set_method(encode_beam_method(report.method));
  info.set_newton_iterations(static_cast<std::uint32_t>(report.newton_iterations));
  info.set_load_steps(static_cast<std::uint32_t>(report.load_steps));
  info.set_relaxation_steps(static_cast<std::uint32_t>(report.relaxation_steps));
  info.set_residual(report.residual);
  info.set_load_factor(report.load_factor);
  if (report.node >= 0) info.set_node(static_cast<std::uint32_t>(report.node));
  if (report.negative_eigenvalues)
    info.set_negative_eigenvalues(static_cast<std::uint32_t>(*report.negative_eigenvalues));
  encode_beam_snaps(report.snaps, *info.mutable_snaps());
  encode_beam_stability(report, info);
}

std::uint32_t index_or_zero(int index) { return static_cast<std::uint32_t>(std::max(index, 0)); }

void encode_errors(const beams::DiscretisationError& error, proto::DiscretisationError& message) {
  if (error.is_known) {
    message.set_position_error(error.position_error);
    message.set_max_distance(error.max_distance);
    message.set_worst_node(index_or_zero(error.worst_node));
    message.set_energy_error(error.energy_error);
  }
  if (error.worst_moment_element >= 0) {
    message.set_moment_error(error.moment_error);
    message.set_max_moment_error(error.max_moment_error);
    message.set_worst_moment_element(index_or_zero(error.worst_moment_element));
  }
  if (!error.utilisation_error) return;
  message.set_utilisation_error(*error.utilisation_error);
  message.set_worst_utilisation_element(index_or_zero(error.worst_utilisation_element));
}

}  // namespace

proto::DiscretisationError encode_discretisation(const session::DiscretisationCheck& check) {
  const beams::DiscretisationError& error = check.error;
  proto::DiscretisationError message;
  message.set_elements(static_cast<std::uint32_t>(error.elements));
  if (error.compared_elements > 0) encode_errors(error, message);
  if (error.is_known)
    message.set_compared_elements(static_cast<std::uint32_t>(error.compared_elements));
  message.set_tolerance(check.tolerance.value_or(0));
  message.set_within_tolerance(check.within_tolerance());
  message.set_check_ms(check.check_ms);
  message.set_message(error.message);
  return message;
}

proto::ResultInfo encode_beam_result(const session::BeamResult& result) {
  proto::ResultInfo info = encode_header(result);
  info.set_status(proto::SOLVE_STATUS_IMPROVED);
  info.set_weight_scale(1);
  auto& message = *info.mutable_beams();
  if (!result.is_final) return info;
  info.set_status(kSolveStatuses.encode(result.report.status));
  info.set_message(beam_message(result.report));
  info.set_iterations(static_cast<std::uint32_t>(result.report.newton_iterations));
  info.set_gradient(result.report.residual);
  encode_beam_report(result.report, message);
  message.set_steps(static_cast<std::uint32_t>(result.frames->cols()));
  if (!result.analysis) return info;
  const beams::BeamResults& results = result.analysis->results;
  info.set_total_energy(results.energies.total());
  *message.mutable_energies() = encode_beam_energies(results.energies);
  message.set_largest_utilisation(results.largest_utilisation);
  message.set_largest_bend(results.largest_bend);
  if (result.discretisation)
    *info.mutable_discretisation_error() = encode_discretisation(*result.discretisation);
  return info;
}

proto::GetGeometryResponse encode_beam_geometry(const beams::BeamModel& model) {
  Eigen::Matrix3Xd rest(3, static_cast<Eigen::Index>(model.nodes.size()));
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    rest.col(static_cast<Eigen::Index>(i)) = model.nodes[i].position;
  proto::GetGeometryResponse response;
  *response.mutable_rest() = encode_points(rest);
  response.mutable_beams()->set_nodes(static_cast<std::uint32_t>(model.nodes.size()));
  *response.mutable_beams()->mutable_elements() = encode_beam_elements(model);
  return response;
}

std::uint64_t BeamFrames::bytes(proto::Encoding encoding, int count) const {
  const auto values = static_cast<std::uint64_t>(count) * static_cast<std::uint64_t>(nodes());
  if (encoding == proto::ENCODING_POSITIONS_QUANTISED) return values * 3 * sizeof(std::uint16_t);
  return values * (encoding == proto::ENCODING_POSITIONS ? 3 : 7) * bytes_of(precision());
}

scene::Precision BeamFrames::precision() const {
  if (result_->frames->cols() == 0) return scene::Precision::kFloat32;
  const Eigen::MatrixXd shape = result_->frames->rightCols<1>().reshaped(7, nodes());
  return scene::precision_for(shape.topRows<3>());
}

proto::Frames BeamFrames::encode(proto::Encoding encoding, FrameRange range) const {
  proto::Frames frames = frames_of(encode_beam_result(*result_), encoding, range);
  const auto columns = result_->frames->middleCols(range.first, range.count);
  if (!is_of_positions(encoding)) {
    set_coordinates(columns, precision(), frames);
    return frames;
  }
  Eigen::MatrixXd positions(3 * nodes(), range.count);
  for (Eigen::Index i = 0; i < nodes(); ++i)
    positions.middleRows<3>(3 * i) = columns.middleRows<3>(7 * i);
  set_positions(positions, precision(), encoding, frames);
  return frames;
}

}  // namespace limber::server
