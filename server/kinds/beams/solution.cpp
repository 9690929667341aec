#include "server/kinds/beams/solution.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/degrees.h"
#include "engine/session/beams/files.h"
#include "server/kinds/beams/structure.h"
#include "server/wire/arrays.h"
#include "server/wire/enum_table.h"
#include "server/wire/file_stem.h"
#include "server/wire/indices.h"
#include "server/wire/precise_frames.h"
#include "server/wire/vectors.h"

namespace limber::server {
namespace {

constexpr std::uint32_t kMaxShapes = 256;

constexpr EnumTable<beams::BeamMethod, proto::BeamMethod, proto::BeamMethod_MAX> kBeamMethods{
    {beams::BeamMethod::kChoose, proto::BEAM_METHOD_UNSPECIFIED},
    {beams::BeamMethod::kNewton, proto::BEAM_METHOD_NEWTON},
    {beams::BeamMethod::kRelaxation, proto::BEAM_METHOD_RELAXATION},
    {beams::BeamMethod::kRelaxationThenNewton, proto::BEAM_METHOD_RELAXATION_THEN_NEWTON}};

/// A cancelled analysis is never shown.
constexpr EnumTable<beams::BeamStatus, proto::BeamStatus, proto::BeamStatus_MAX> kBeamStatuses{
    {beams::BeamStatus::kConverged, proto::BEAM_STATUS_CONVERGED},
    {beams::BeamStatus::kStalled, proto::BEAM_STATUS_STALLED},
    {beams::BeamStatus::kUnstable, proto::BEAM_STATUS_UNSTABLE},
    {beams::BeamStatus::kMechanism, proto::BEAM_STATUS_MECHANISM},
    {beams::BeamStatus::kIterationLimit, proto::BEAM_STATUS_ITERATION_LIMIT},
    {beams::BeamStatus::kCancelled, proto::BEAM_STATUS_UNSPECIFIED}};

beams::BeamModel decode_source(const proto::SolveBeamsRequest& request) {
  switch (request.source_case()) {
    case proto::SolveBeamsRequest::kStructure:
      return decode_beam_structure(request.structure(), "structure").model;
    case proto::SolveBeamsRequest::kJob:
      return decode_beam_job(request.job(), "job").model;
    case proto::SolveBeamsRequest::SOURCE_NOT_SET:
      break;
  }
  throw invalid("structure", "a structure or a job is expected");
}

Eigen::MatrixXd force_rows(const std::vector<beams::ElementForces>& forces) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(forces.size()), 8);
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const beams::ElementForces& f = forces[i];
    rows.row(static_cast<Eigen::Index>(i)) << f.axial, f.torque, f.shear_2, f.shear_3,
        f.start_moment_2, f.start_moment_3, f.finish_moment_2, f.finish_moment_3;
  }
  return rows;
}

Eigen::MatrixXd stress_rows(const std::vector<beams::ElementStresses>& stresses) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(stresses.size()), 5);
  for (std::size_t i = 0; i < stresses.size(); ++i) {
    const beams::ElementStresses& s = stresses[i];
    rows.row(static_cast<Eigen::Index>(i)) << s.axial, s.bending, s.torsion, s.equivalent,
        s.utilisation;
  }
  return rows;
}

/// elements x 6 x 4: of each force and moment the least value, its place, the largest, its place.
proto::Array encode_extremes(const std::vector<beams::ElementExtremes>& extremes) {
  proto::Array array;
  array.set_type(proto::DATA_TYPE_FLOAT64);
  for (const std::uint64_t size :
       {static_cast<std::uint64_t>(extremes.size()),
        static_cast<std::uint64_t>(beams::SectionForces::kComponents), std::uint64_t{4}})
    array.add_shape(size);
  for (const beams::ElementExtremes& of_element : extremes) {
    for (const beams::Extremes& e : of_element) {
      const double values[] = {e.least, e.least_place, e.largest, e.largest_place};
      array.mutable_data()->append(reinterpret_cast<const char*>(values), sizeof values);
    }
  }
  return array;
}

/// elements x stations x 8: forces and moments, equivalent stress, utilisation.
proto::Array encode_stations(const session::BeamAnalysis& analysis, int count) {
  constexpr std::uint64_t kColumns = beams::SectionForces::kComponents + 2;
  proto::Array array;
  array.set_type(proto::DATA_TYPE_FLOAT64);
  const beams::BeamModel& model = analysis.structure.model();
  for (const std::uint64_t size : {static_cast<std::uint64_t>(model.elements.size()),
                                   static_cast<std::uint64_t>(count), kColumns})
    array.add_shape(size);
  for (int e = 0; e < static_cast<int>(model.elements.size()); ++e) {
    for (const beams::Station& station : stations_along(analysis.results, model, e, count)) {
      const auto forces = station.forces.components();
      const double last[] = {station.equivalent, station.utilisation};
      array.mutable_data()->append(reinterpret_cast<const char*>(forces.data()), sizeof forces);
      array.mutable_data()->append(reinterpret_cast<const char*>(last), sizeof last);
    }
  }
  return array;
}

Eigen::MatrixXd rotation_rows(const beams::BeamState& state) {
  Eigen::MatrixXd rows(state.nodes(), 4);
  for (int i = 0; i < state.nodes(); ++i) {
    const Eigen::Quaterniond& q = state.rotations[static_cast<std::size_t>(i)];
    rows.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  return rows;
}

proto::Array encode_column(const std::vector<double>& values) {
  proto::Array array;
  array.set_type(proto::DATA_TYPE_FLOAT64);
  array.add_shape(values.size());
  array.set_data(values.data(), values.size() * sizeof(double));
  return array;
}

proto::Array encode_shapes(const session::BeamAnalysis& analysis) {
  proto::Array array;
  const bool is_far =
      scene::precision_for(analysis.solution.state.positions) == scene::Precision::kFloat64;
  array.set_type(is_far ? proto::DATA_TYPE_FLOAT64 : proto::DATA_TYPE_FLOAT32);
  array.add_shape(analysis.shapes.size());
  array.add_shape(static_cast<std::uint64_t>(analysis.structure.nodes()));
  array.add_shape(3);
  for (const Eigen::Matrix3Xd& shape : analysis.shapes) {
    const auto precision = is_far ? scene::Precision::kFloat64 : scene::Precision::kFloat32;
    array.mutable_data()->append(encode_points(shape, precision).data());
  }
  return array;
}

void encode_solution_report(const beams::BeamReport& report, proto::BeamSolution& message) {
  message.set_status(encode_beam_status(report.status));
  message.set_method(encode_beam_method(report.method));
  message.set_newton_iterations(static_cast<std::uint32_t>(report.newton_iterations));
  message.set_load_steps(static_cast<std::uint32_t>(report.load_steps));
  message.set_relaxation_steps(static_cast<std::uint32_t>(report.relaxation_steps));
  message.set_residual(report.residual);
  message.set_load_factor(report.load_factor);
  if (report.node >= 0) message.set_node(static_cast<std::uint32_t>(report.node));
  if (report.negative_eigenvalues)
    message.set_negative_eigenvalues(static_cast<std::uint32_t>(*report.negative_eigenvalues));
  message.set_message(beam_message(report));
  encode_beam_snaps(report.snaps, *message.mutable_snaps());
  encode_beam_stability(report, message);
}

proto::ExportedFile file_of(std::string name, std::string content) {
  proto::ExportedFile file;
  file.set_name(std::move(name));
  file.set_content(std::move(content));
  return file;
}

}  // namespace

proto::BeamMethod encode_beam_method(beams::BeamMethod method) {
  return kBeamMethods.encode(method);
}

proto::BeamStatus encode_beam_status(beams::BeamStatus status) {
  return kBeamStatuses.encode(status);
}

std::string beam_message(const beams::BeamReport& report) {
  constexpr std::size_t kMost = 3;  // further ones are counted
  if (report.snaps.empty()) return report.message;
  std::string text = report.message.empty() ? "" : report.message + "; ";
  text += "the structure snapped to another shape";
  for (std::size_t i = 0; i < std::min(kMost, report.snaps.size()); ++i) {
    const beams::BeamSnap& snap = report.snaps[i];
    text += fmt::format("{} at {:.4g} % of the path", i == 0 ? "" : ",", 100 * snap.load_factor);
    if (snap.node >= 0)
      text += fmt::format(" (node {} turned by {:.3g} degrees)", snap.node,
                          snap.turn * kDegreesPerRadian);
  }
  if (report.snaps.size() > kMost)
    text += fmt::format(", and {} more times", report.snaps.size() - kMost);
  return text;
}

void encode_beam_snaps(const std::vector<beams::BeamSnap>& snaps,
                       google::protobuf::RepeatedPtrField<proto::BeamSnap>& messages) {
  for (const beams::BeamSnap& snap : snaps) {
    auto& message = *messages.Add();
    message.set_progress(snap.load_factor);
    message.set_turn(snap.turn);
    message.set_node(static_cast<std::uint32_t>(std::max(snap.node, 0)));
  }
}

proto::BeamNeutralDirection encode_beam_neutral_direction(
    const beams::BeamNeutralDirection& direction) {
  proto::BeamNeutralDirection message;
  message.set_node(static_cast<std::uint32_t>(std::max(direction.node, 0)));
  encode_vector(direction.translation, *message.mutable_translation());
  encode_vector(direction.rotation, *message.mutable_rotation());
  return message;
}

proto::BeamEnergies encode_beam_energies(const beams::BeamEnergies& energies) {
  proto::BeamEnergies message;
  message.set_stretching(energies.stretching);
  message.set_torsion(energies.torsion);
  message.set_bending_2(energies.bending_2);
  message.set_bending_3(energies.bending_3);
  return message;
}

proto::Array encode_beam_elements(const beams::BeamModel& model) {
  Eigen::MatrixXi pairs(2, static_cast<Eigen::Index>(model.elements.size()));
  for (std::size_t i = 0; i < model.elements.size(); ++i)
    pairs.col(static_cast<Eigen::Index>(i)) << model.elements[i].start, model.elements[i].finish;
  return encode_indices(pairs);
}

BeamRequest decode_beams(const proto::SolveBeamsRequest& request) {
  BeamRequest decoded;
  if (request.follow()) decoded.options = beams::BeamSolveOptions::following();
  decoded.options.method = kBeamMethods.decode(request.method());
  const beams::BeamMethod method = decoded.options.method;
  if (request.follow() && method != beams::BeamMethod::kChoose &&
      method != beams::BeamMethod::kNewton)
    throw invalid("follow", fmt::format("method {} follows no branch: Newton's does",
                                        beams::to_string(method)));
  if (request.has_tolerance())
    decoded.options.tolerance = decoded.options.relaxation_tolerance = request.tolerance();
  decoded.options.validate();
  if (request.shapes() > kMaxShapes)
    throw limit_exceeded("shapes", "shapes to keep", kMaxShapes, request.shapes());
  decoded.shapes = decode_index(request.shapes(), "shapes");
  decoded.stations = decode_stations(request);
  decoded.is_estimated = request.estimate();
  for (int i = 0; i < request.files_size(); ++i) {
    if (request.files(i) == proto::BEAM_FILE_FORMAT_UNSPECIFIED)
      throw invalid(fmt::format("files[{}]", i), "unspecified");
    const auto format = request.files(i);
    if (std::find(decoded.files.begin(), decoded.files.end(), format) != decoded.files.end())
      throw invalid(fmt::format("files[{}]", i), "requested twice");
    decoded.files.push_back(format);
  }
  decoded.stem = decode_file_stem(request.stem(), "beams");
  decoded.model = decode_source(request);
  return decoded;
}

proto::BeamSolution encode_beams(const session::BeamAnalysis& analysis, int stations) {
  const beams::BeamState& state = analysis.solution.state;
  const beams::BeamResults& results = analysis.results;
  proto::BeamSolution message;
  encode_solution_report(analysis.solution.report, message);
  *message.mutable_positions() = encode_points_float64(state.positions);
  *message.mutable_rotations() = encode_matrix(rotation_rows(state));
  *message.mutable_reaction_forces() = encode_points_float64(results.reaction_forces);
  *message.mutable_reaction_moments() = encode_points_float64(results.reaction_moments);
  *message.mutable_element_forces() = encode_matrix(force_rows(results.forces));
  *message.mutable_element_stresses() = encode_matrix(stress_rows(results.stresses));
  *message.mutable_element_extremes() = encode_extremes(results.extremes);
  *message.mutable_governing_places() = encode_column(results.governing_places);
  if (stations > 0) *message.mutable_stations() = encode_stations(analysis, stations);
  *message.mutable_element_energies() = encode_column(results.element_energies);
  *message.mutable_energies() = encode_beam_energies(results.energies);
  message.set_largest_utilisation(results.largest_utilisation);
  message.set_largest_bend(results.largest_bend);
  *message.mutable_elements() = encode_beam_elements(analysis.structure.model());
  *message.mutable_shapes() = encode_shapes(analysis);
  return message;
}

std::vector<proto::ExportedFile> beam_files(const session::BeamAnalysis& analysis,
                                            const BeamRequest& request) {
  std::vector<proto::ExportedFile> files;
  for (const proto::BeamFileFormat format : request.files) {
    if (format == proto::BEAM_FILE_FORMAT_VTU)
      files.push_back(file_of(request.stem + ".vtu", session::beam_vtu(analysis)));
    if (format == proto::BEAM_FILE_FORMAT_JSON)
      files.push_back(
          file_of(request.stem + ".json", session::beam_json(analysis, request.stations)));
    if (format != proto::BEAM_FILE_FORMAT_CSV) continue;
    files.push_back(file_of(request.stem + "_nodes.csv", session::beam_nodes_csv(analysis)));
    files.push_back(file_of(request.stem + "_elements.csv", session::beam_elements_csv(analysis)));
    if (request.stations > 0)
      files.push_back(file_of(request.stem + "_stations.csv",
                              session::beam_stations_csv(analysis, request.stations)));
  }
  return files;
}

}  // namespace limber::server
