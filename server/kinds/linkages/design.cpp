#include "server/kinds/linkages/design.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>
#include <utility>

#include "engine/base/degrees.h"
#include "engine/rods/design/mesh_surface.h"
#include "engine/rods/design/starting_grid.h"
#include "engine/rods/design/surface_through_points.h"
#include "engine/rods/section/section.h"
#include "engine/scene/formats/surface_formats.h"
#include "server/kinds/linkages/scene.h"
#include "server/kinds/linkages/section.h"
#include "server/wire/arrays.h"
#include "server/wire/enum_table.h"
#include "server/wire/fields.h"
#include "server/wire/indices.h"
#include "server/wire/vectors.h"

namespace limber::server {
namespace {

using Surface = std::shared_ptr<const rods::TargetSurface>;

std::vector<rods::JointTarget> decode_targets(
    const google::protobuf::RepeatedPtrField<proto::DesignTarget>& messages,
    const std::string& field) {
  std::vector<rods::JointTarget> targets;
  for (int i = 0; i < messages.size(); ++i) {
    const proto::DesignTarget& message = messages[i];
    const std::string path = fmt::format("{}[{}]", field, i);
    if (!message.has_position()) throw invalid(path + ".position", "missing");
    targets.push_back({decode_index(message.joint(), path + ".joint"),
                       decode_vector(message.position()),
                       message.has_weight() ? message.weight() : 1});
  }
  return targets;
}

constexpr EnumTable<rods::LengthVariables, proto::DesignLengths, proto::DesignLengths_MAX>
    kLengthVariables{{rods::LengthVariables::kSegments, proto::DESIGN_LENGTHS_SEGMENTS},
                     {rods::LengthVariables::kEdges, proto::DESIGN_LENGTHS_EDGES},
                     {rods::LengthVariables::kKept, proto::DESIGN_LENGTHS_KEPT}};

constexpr EnumTable<rods::SectionVariables, proto::DesignSections, proto::DesignSections_MAX>
    kSectionVariables{{rods::SectionVariables::kKept, proto::DESIGN_SECTIONS_KEPT},
                      {rods::SectionVariables::kSegments, proto::DESIGN_SECTIONS_SEGMENTS}};

constexpr EnumTable<rods::BucklingGuard, proto::DesignGuard, proto::DesignGuard_MAX> kGuards{
    {rods::BucklingGuard::kWhenNeeded, proto::DESIGN_GUARD_WHEN_NEEDED},
    {rods::BucklingGuard::kFromStart, proto::DESIGN_GUARD_FROM_START},
    {rods::BucklingGuard::kNever, proto::DESIGN_GUARD_NEVER}};

constexpr EnumTable<session::DesignState, proto::DesignState, proto::DesignState_MAX> kDesignStates{
    {session::DesignState::kStarting, proto::DESIGN_STATE_STARTING},
    {session::DesignState::kRunning, proto::DESIGN_STATE_RUNNING},
    {session::DesignState::kPaused, proto::DESIGN_STATE_PAUSED},
    {session::DesignState::kEnded, proto::DESIGN_STATE_ENDED}};

constexpr EnumTable<session::DesignEnd, proto::DesignEnd, proto::DesignEnd_MAX> kDesignEnds{
    {session::DesignEnd::kNone, proto::DESIGN_END_UNSPECIFIED},
    {session::DesignEnd::kConverged, proto::DESIGN_END_CONVERGED},
    {session::DesignEnd::kSettled, proto::DESIGN_END_SETTLED},
    {session::DesignEnd::kInfeasible, proto::DESIGN_END_INFEASIBLE},
    {session::DesignEnd::kStuck, proto::DESIGN_END_STUCK},
    {session::DesignEnd::kIterationLimit, proto::DESIGN_END_ITERATION_LIMIT},
    {session::DesignEnd::kStopped, proto::DESIGN_END_STOPPED},
    {session::DesignEnd::kFailed, proto::DESIGN_END_FAILED}};

rods::SurfaceMesh mesh_of(scene::TriangleSurface surface) {
  return {std::move(surface.vertices), std::move(surface.triangles)};
}

rods::SurfaceMesh decode_mesh(const proto::DesignSurface& message, const std::string& field,
                              const SurfaceLoader& load) {
  switch (message.source_case()) {
    case proto::DesignSurface::kFile:
      return mesh_of(scene::read_surface(message.file().name(), message.file().content()));
    case proto::DesignSurface::kPath:
      return mesh_of(load(message.path(), field + ".path"));
    case proto::DesignSurface::kTriangles:
      return {decode_points(message.triangles().vertices(), field + ".triangles.vertices"),
              decode_triples(message.triangles().triangles(), field + ".triangles.triangles")};
    case proto::DesignSurface::kPoints:
      return rods::surface_through_points(decode_points(message.points(), field + ".points"));
    case proto::DesignSurface::SOURCE_NOT_SET:
      break;
  }
  throw invalid(field, "a surface needs a file, a path, triangles or points");
}

/// Errors of readers and the engine about a surface get its source as field.
template <class Make>
auto with_surface_fields(const proto::DesignSurface& message, const std::string& field,
                         const Make& make) {
  const auto rename = [&](const std::string& name) {
    constexpr std::string_view kOfMesh = "surface.";
    const std::string place =
        field_in(message, name.starts_with(kOfMesh) ? name.substr(kOfMesh.size()) : name);
    return place.empty() ? field : field + "." + place;
  };
  return with_fields(rename, make);
}

Surface decode_surface(const proto::DesignSurface& message, const std::string& field,
                       const SurfaceLoader& load) {
  return with_surface_fields(message, field, [&]() -> Surface {
    return std::make_shared<const rods::MeshSurface>(decode_mesh(message, field, load));
  });
}

rods::SurfacePlacement decode_placement(const proto::SurfacePlacement& message) {
  rods::SurfacePlacement placement;
  const Eigen::Vector3d turn = kDegree * decode_vector(message.rotation_degrees());
  if (turn.norm() > 0) placement.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized());
  if (message.has_scale()) placement.scale = message.scale();
  placement.translation = decode_vector(message.translation());
  return placement;
}

session::DesignGoal decode_goal(const proto::DesignGoal& message, const std::string& field,
                                const SurfaceLoader& load) {
  session::DesignGoal goal;
  if (message.has_flat_share()) goal.flat_share = message.flat_share();
  if (message.has_distance_weight()) goal.distance_weight = message.distance_weight();
  if (message.has_surface_weight()) goal.surface_weight = message.surface_weight();
  goal.targets = decode_targets(message.targets(), field + ".targets");
  goal.placement = decode_placement(message.placement());
  goal.joint_surface_weights = decode_numbers(message.joint_surface_weights());
  if (message.has_surface())
    goal.surface = decode_surface(message.surface(), field + ".surface", load);
  return goal;
}

void encode_terms(const session::DesignTerms& terms, double length_unit,
                  proto::DesignTerms& message) {
  message.set_objective(terms.objective);
  message.set_flat_energy(terms.flat_energy * length_unit);
  message.set_deployed_energy(terms.deployed_energy * length_unit);
  message.set_target_rms(terms.target_rms);
  message.set_surface_rms(terms.surface_rms);
  message.set_flat_height(terms.flat_height);
  message.set_smallest_angle_degrees(to_degrees(terms.smallest_angle));
  message.set_holds(terms.holds);
  message.set_covered_area(terms.covered_area);
  message.set_cover(terms.cover);
}

void encode_placement(const rods::SurfacePlacement& placement, proto::SurfacePlacement& message) {
  const auto encode = [](const Eigen::Vector3d& vector, proto::Vector3& to) {
    to.set_x(vector.x()), to.set_y(vector.y()), to.set_z(vector.z());
  };
  const Eigen::AngleAxisd turn(placement.rotation.normalized());
  encode(turn.angle() / kDegree * turn.axis(), *message.mutable_rotation_degrees());
  message.set_scale(placement.scale);
  encode(placement.translation, *message.mutable_translation());
}

/// Encodes the variables, and the outcomes of its trials.
void encode_course(const session::DesignInfo& info, double length_unit,
                   proto::DesignInfo& message) {
  message.set_lengths(kLengthVariables.encode(info.variables.lengths));
  message.set_sections(kSectionVariables.encode(info.variables.sections));
  message.set_guard(kGuards.encode(info.guard));
  for (const int segment : info.sections_at_bound)
    message.add_sections_at_bound(static_cast<std::uint32_t>(segment));
  message.set_refused(static_cast<std::uint32_t>(info.trials.refused));
  message.set_not_believed(static_cast<std::uint32_t>(info.trials.not_believed));
  message.set_flat_lost(static_cast<std::uint32_t>(info.trials.flat_lost));
  message.set_guarded(info.trials.guarded);
  message.set_refusal(info.trials.refusal);
  if (info.goal.surface) encode_placement(info.goal.placement, *message.mutable_placement());
  for (const session::OtherOptimum& other : info.other_optima) {
    proto::OtherOptimum& added = *message.add_other_optima();
    added.set_job(other.tag);
    encode_terms(other.terms, length_unit, *added.mutable_terms());
    added.set_size_difference(other.difference.lengths);
    added.set_flat_distance(other.difference.flat);
    added.set_deployed_distance(other.difference.deployed);
  }
}

}  // namespace

session::DesignRequest decode_design(const proto::StartDesignRequest& request,
                                     const SurfaceLoader& load) {
  session::DesignRequest design;
  design.goal = decode_goal(request.goal(), "goal", load);
  if (request.has_shortest()) design.shortest = request.shortest();
  if (request.has_longest()) design.longest = request.longest();
  if (request.has_flat_height()) design.flat_height = request.flat_height();
  if (request.has_smallest_angle_degrees()) {
    design.smallest_angle =
        decode_angle(request.smallest_angle_degrees(), "smallest_angle_degrees");
  }
  if (request.has_flat_angle_degrees())
    design.flat_angle = decode_angle(request.flat_angle_degrees(), "flat_angle_degrees");
  if (request.has_least_cover()) design.least_cover = request.least_cover();
  if (request.has_max_iterations())
    design.max_iterations = decode_index(request.max_iterations(), "max_iterations");
  design.shortest_lengths = decode_numbers(request.shortest_lengths());
  design.longest_lengths = decode_numbers(request.longest_lengths());
  design.variables = {kLengthVariables.decode(request.lengths()),
                      kSectionVariables.decode(request.sections())};
  if (request.has_thinnest()) design.thinnest = request.thinnest();
  if (request.has_thickest()) design.thickest = request.thickest();
  design.thinnest_sections = decode_numbers(request.thinnest_sections());
  design.thickest_sections = decode_numbers(request.thickest_sections());
  design.guard = kGuards.decode(request.guard());
  if (request.has_fitted_points())
    design.fitted_points = decode_points(request.fitted_points(), "fitted_points");
  return design;
}

session::DesignChange decode_design_change(const proto::ChangeDesignRequest& request,
                                           const SurfaceLoader& load) {
  session::DesignChange change;
  if (request.has_flat_share()) change.flat_share = request.flat_share();
  if (request.has_distance_weight()) change.distance_weight = request.distance_weight();
  if (request.has_surface_weight()) change.surface_weight = request.surface_weight();
  if (request.has_targets())
    change.targets = decode_targets(request.targets().targets(), "targets.targets");
  if (request.has_surface()) {
    const bool none = request.surface().source_case() == proto::DesignSurface::SOURCE_NOT_SET;
    change.surface = none ? nullptr : decode_surface(request.surface(), "surface", load);
  }
  if (request.has_placement()) change.placement = decode_placement(request.placement());
  if (request.has_joint_surface_weights())
    change.joint_surface_weights = decode_numbers(request.joint_surface_weights().weights());
  return change;
}

proto::MakeStartingGridResponse make_starting_grid(const proto::MakeStartingGridRequest& request,
                                                   const SurfaceLoader& load) {
  rods::StartingGridOptions options;
  if (request.has_columns()) options.columns = decode_index(request.columns(), "columns");
  if (request.has_rows()) options.rows = decode_index(request.rows(), "rows");
  if (request.has_flat_angle_degrees()) options.flat_angle = kDegree * request.flat_angle_degrees();
  if (request.has_margin()) options.margin = request.margin();
  if (request.has_drive()) options.drive = request.drive();
  if (request.has_section()) options.section = decode_section(request.section(), "section");
  const rods::SurfacePlacement placement = decode_placement(request.placement());
  const auto named = [&](const std::string& field) { return field_in(request, field); };
  with_fields(named, [&] { options.validate(); });
  with_fields_of(request.placement(), "placement.", [&] { placement.validate(); });
  rods::SurfaceMesh mesh = with_surface_fields(request.surface(), "surface", [&] {
    return decode_mesh(request.surface(), "surface", load);
  });
  const rods::StartingGrid grid =
      with_fields(named, [&] { return rods::starting_grid(std::move(mesh), placement, options); });
  proto::MakeStartingGridResponse response;
  const auto encode = [](const rods::LineMesh& lines, proto::LineArrays& message) {
    *message.mutable_vertices() = encode_points_float64(lines.vertices);
    *message.mutable_edges() = encode_indices(lines.edges);
  };
  encode(grid.flat, *response.mutable_flat());
  encode(grid.deployed, *response.mutable_deployed());
  for (const double length : grid.rest_lengths) response.add_segment_lengths(length);
  response.set_mean_angle_degrees(to_degrees(grid.mean_angle));
  response.set_misfit(grid.misfit);
  for (const double push : grid.push) response.add_push(push);
  response.set_remark(grid.remark);
  return response;
}

proto::DesignInfo encode_design(const session::DesignInfo& info, double length_unit) {
  proto::DesignInfo message;
  message.set_job(info.tag);
  message.set_state(kDesignStates.encode(info.state));
  message.set_end(kDesignEnds.encode(info.end));
  message.set_iteration(static_cast<std::uint32_t>(info.iteration));
  message.set_max_iterations(static_cast<std::uint32_t>(info.max_iterations));
  message.set_accepted(info.accepted);
  encode_terms(info.start, length_unit, *message.mutable_start());
  encode_terms(info.now, length_unit, *message.mutable_now());
  encode_terms(info.best, length_unit, *message.mutable_best());
  message.set_best_iteration(static_cast<std::uint32_t>(info.best_iteration));
  message.set_flat_height(info.flat_height_allowed);
  if (info.smallest_angle_allowed)
    message.set_smallest_angle_degrees(to_degrees(*info.smallest_angle_allowed));
  if (info.flat_angle) message.set_flat_angle_degrees(to_degrees(*info.flat_angle));
  message.set_least_cover(info.least_cover);
  if (info.erection) *message.mutable_erection() = encode_erection(*info.erection);
  message.set_flat_share(info.goal.flat_share);
  message.set_distance_weight(info.goal.distance_weight);
  message.set_surface_weight(info.goal.surface_weight);
  message.set_targets(static_cast<std::uint32_t>(info.goal.targets.size()));
  message.set_has_surface(info.goal.surface != nullptr);
  for (const int segment : info.at_bound) message.add_at_bound(static_cast<std::uint32_t>(segment));
  encode_course(info, length_unit, message);
  if (info.taken) message.set_taken_revision(*info.taken);
  message.set_message(info.message);
  if (info.end == session::DesignEnd::kFailed) {
    *message.mutable_error() = error_to_proto(
        Error(info.fault, field_in(proto::StartDesignRequest(), info.fault_field), info.message));
  }
  return message;
}

}  // namespace limber::server
