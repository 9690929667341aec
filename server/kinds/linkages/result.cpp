#include "server/kinds/linkages/result.h"

#include "server/kinds/linkages/design.h"
#include "server/kinds/linkages/scene.h"
#include "server/wire/arrays.h"
#include "server/wire/enum_table.h"
#include "server/wire/session_values.h"

namespace limber::server {
namespace {

constexpr EnumTable<rods::EquilibriumStatus, proto::SolveStatus> kEquilibriumStatuses{
    {rods::EquilibriumStatus::kConverged, proto::SOLVE_STATUS_CONVERGED},
    {rods::EquilibriumStatus::kIterationLimit, proto::SOLVE_STATUS_ITERATION_LIMIT},
    {rods::EquilibriumStatus::kStalled, proto::SOLVE_STATUS_STALLED},
    {rods::EquilibriumStatus::kSaddle, proto::SOLVE_STATUS_SADDLE},
    {rods::EquilibriumStatus::kUnbalanced, proto::SOLVE_STATUS_UNBALANCED},
    {rods::EquilibriumStatus::kCancelled, proto::SOLVE_STATUS_CANCELLED}};

constexpr EnumTable<rods::BranchEvent, proto::BranchEvent, proto::BranchEvent_MAX> kBranchEvents{
    {rods::BranchEvent::kNone, proto::BRANCH_EVENT_UNSPECIFIED},
    {rods::BranchEvent::kBranching, proto::BRANCH_EVENT_BRANCHING},
    {rods::BranchEvent::kLimitPoint, proto::BRANCH_EVENT_LIMIT_POINT},
    {rods::BranchEvent::kJump, proto::BRANCH_EVENT_JUMP}};

void encode_report(const rods::EquilibriumReport& report, double length_unit,
                   proto::ResultInfo& info) {
  info.set_status(kEquilibriumStatuses.encode(report.status));
  info.set_iterations(static_cast<std::uint32_t>(report.iterations));
  info.set_message(report.message);
  info.set_total_energy(report.potential() * length_unit);
  info.set_gradient(report.max_gradient_scaled);
  auto& linkage = *info.mutable_linkage();
  linkage.set_stretching_energy(report.energies.stretching * length_unit);
  linkage.set_bending_energy(report.energies.bending * length_unit);
  linkage.set_twisting_energy(report.energies.twisting * length_unit);
  linkage.set_spring_energy(report.spring_energy * length_unit);
  linkage.set_load_potential(report.load_potential * length_unit);
  linkage.set_max_gradient_scaled(report.max_gradient_scaled);
  linkage.set_negative_eigenvalues(static_cast<std::uint32_t>(report.negative_eigenvalues));
  linkage.set_factorizations(static_cast<std::uint32_t>(report.factorizations));
  linkage.set_escapes(static_cast<std::uint32_t>(report.escapes));
  linkage.set_mean_angle_moment(report.mean_angle_moment * length_unit);
}

proto::DiscretisationError encode_shape_check(const session::ShapeCheck& check,
                                              double length_unit) {
  proto::DiscretisationError message;
  message.set_elements(static_cast<std::uint32_t>(check.error.edges));
  if (check.error.is_known())
    message.set_compared_elements(static_cast<std::uint32_t>(check.error.compared_edges));
  message.set_tolerance(check.tolerance);
  message.set_within_tolerance(check.within_tolerance());
  message.set_check_ms(check.check_ms);
  message.set_message(check.error.message);
  if (!check.error.is_known()) return message;
  message.set_position_error(check.position_error());
  message.set_max_distance(check.error.max_distance * length_unit);
  message.set_energy_error(check.error.energy_error);
  if (check.error.stress) {
    message.set_stress_error(check.error.stress->share);
    message.set_max_stress_error(check.error.stress->error / (length_unit * length_unit));
    message.set_worst_stress_segment(static_cast<std::uint32_t>(check.error.stress->segment));
  }
  if (check.error.worst_joint >= 0)
    message.set_worst_node(static_cast<std::uint32_t>(check.error.worst_joint));
  return message;
}

}  // namespace

proto::ResultInfo encode_linkage_result(const session::LinkageResult& result, double length_unit) {
  proto::ResultInfo info = encode_header(result);
  info.set_status(proto::SOLVE_STATUS_IMPROVED);
  info.set_weight_scale(1);
  if (result.is_final) encode_report(result.report, length_unit, info);
  if (result.shape_check) {
    *info.mutable_discretisation_error() = encode_shape_check(*result.shape_check, length_unit);
  } else if (!result.check_failure.empty()) {
    info.mutable_discretisation_error()->set_message(result.check_failure);
  }
  if (result.design) *info.mutable_design() = encode_design(*result.design, length_unit);
  info.mutable_linkage()->set_mean_angle_degrees(to_degrees(result.mean_angle));
  info.mutable_linkage()->set_steps(static_cast<std::uint32_t>(result.path.size()));
  for (const rods::DeploymentStep& step : result.path) {
    auto& message = *info.mutable_linkage()->add_path();
    message.set_progress(step.progress);
    message.set_mean_angle_degrees(to_degrees(step.mean_opening_angle));
    message.set_energy(step.energy * length_unit);
    message.set_iterations(static_cast<std::uint32_t>(step.iterations));
    message.set_event(kBranchEvents.encode(step.event));
  }
  return info;
}

std::optional<session::RecalledAnswer> decode_linkage_answer(const proto::ResultInfo& info) {
  if (!info.converged() || info.has_design() || info.status() == proto::SOLVE_STATUS_CANCELLED)
    return {};
  return session::RecalledAnswer{info.revision(), kEquilibriumStatuses.decode(info.status()),
                                 info.solve_failed(), info.message()};
}

proto::GetGeometryResponse encode_linkage_geometry(const session::LinkageGeometry& geometry,
                                                   const std::string& known_basis_hash) {
  proto::GetGeometryResponse response;
  response.set_basis_hash(geometry.hash);
  if (known_basis_hash == geometry.hash) return response;
  *response.mutable_surface() = encode_indices(geometry.surface);
  auto& linkage = *response.mutable_linkage();
  linkage.set_coordinates(static_cast<std::uint32_t>(geometry.coordinates));
  for (const int edges : geometry.edges) linkage.add_edges(static_cast<std::uint32_t>(edges));
  *linkage.mutable_joints_of_segment() = encode_indices(geometry.joints_of_segment);
  for (const int vertex : geometry.vertex_of_joint)
    linkage.add_vertex_of_joint(static_cast<std::uint32_t>(vertex));
  *linkage.mutable_outline() = encode_polygon(geometry.outline);
  linkage.set_surface_nodes(static_cast<std::uint32_t>(geometry.surface_nodes));
  for (const rods::RodChain& rod : geometry.rods) {
    proto::LinkageRod& made = *linkage.add_rods();
    for (const int segment : rod.segments) made.add_segments(static_cast<std::uint32_t>(segment));
    for (const char reversed : rod.reversed) made.add_reversed(reversed != 0);
    made.set_closed(rod.is_closed);
  }
  linkage.set_mixed_angles(geometry.mixed_angles);
  return response;
}

std::uint64_t LinkageFrames::kept_bytes() const {
  std::uint64_t bytes = static_cast<std::uint64_t>(result_->frames->size()) * sizeof(double);
  if (result_->strains)
    bytes += static_cast<std::uint64_t>(result_->strains->size()) * sizeof(float);
  return sizeof(session::LinkageResult) + bytes;
}

scene::Precision LinkageFrames::precision() const {
  if (result_->frames->cols() == 0) return scene::Precision::kFloat32;
  const Eigen::VectorXd surface =
      result_->shape->surface(result_->frames->rightCols<1>(), result_->section_scales);
  return scene::precision_for(surface.reshaped(3, surface.size() / 3));
}

std::uint64_t LinkageFrames::bytes(proto::Encoding encoding, int count) const {
  const auto frames = static_cast<std::uint64_t>(count);
  const auto values = 3 * static_cast<std::uint64_t>(result_->shape->surface_nodes());
  if (encoding == proto::ENCODING_POSITIONS) return frames * values * bytes_of(precision());
  if (encoding == proto::ENCODING_POSITIONS_QUANTISED)
    return frames * values * sizeof(std::uint16_t);
  return frames * static_cast<std::uint64_t>(result_->frames->rows()) * bytes_of(precision());
}

proto::Frames LinkageFrames::encode(proto::Encoding encoding, FrameRange range) const {
  proto::Frames frames = frames_of(encode_linkage_result(*result_, length_unit_), encoding, range);
  frames.set_basis_hash(result_->geometry->hash);
  const auto columns = result_->frames->middleCols(range.first, range.count);
  if (is_of_positions(encoding)) {
    Eigen::MatrixXd positions(3 * static_cast<Eigen::Index>(result_->shape->surface_nodes()),
                              range.count);
    for (int i = 0; i < range.count; ++i)
      positions.col(i) = result_->shape->surface(columns.col(i), result_->section_scales);
    set_positions(positions, precision(), encoding, frames);
  } else {
    set_coordinates(columns, precision(), frames);
  }
  return frames;
}

}  // namespace limber::server
