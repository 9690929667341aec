#include "server/kinds/beams/scene.h"

#include <algorithm>

#include "engine/base/checked_number.h"
#include "server/kinds/beams/shape.h"
#include "server/wire/arrays.h"
#include "server/wire/fields.h"
#include "server/wire/scene_fields.h"

namespace limber::server {
namespace {

void demand_beams_alone(const proto::Scene& message, const std::string& prefix) {
  if (const auto* field = field_beside(message, {"name", "beams"}))
    throw invalid(prefix + field->name(),
                  field->name() == "length_unit_in_metres"
                      ? "structures of beams are in metres"
                      : "is of other scenes: one of beams has no such field");
}

/// @throws Error naming the field
beams::BeamDiscretisation decode_discretisation(const proto::BeamScene& message) {
  beams::BeamDiscretisation discretisation;
  if (message.has_elements_per_member()) {
    constexpr int kTooMany = beams::BeamDiscretisation::kMaxParts + 1;
    discretisation.elements_per_member =
        to_whole<int>(message.elements_per_member()).value_or(kTooMany);
  }
  if (message.has_tolerance()) discretisation.tolerance = message.tolerance();
  discretisation.validate();
  return discretisation;
}

scene::EdgeMesh edges_of(const proto::LineSource& lines, const std::string& field,
                         const EdgeLoader& load_edges) {
  if (!lines.has_arrays()) return load_edges(lines, field);
  scene::EdgeMesh drawing;
  drawing.vertices = decode_points(lines.arrays().vertices(), field + ".arrays.vertices");
  const Eigen::Matrix2Xi pairs = decode_pairs(lines.arrays().edges(), field + ".arrays.edges");
  drawing.normals = Eigen::Vector3d::UnitZ().replicate(1, drawing.vertices.cols());
  for (const auto& pair : pairs.colwise()) drawing.edges.emplace_back(pair[0], pair[1]);
  return drawing;
}

}  // namespace

DecodedBeams decode_beam_scene(const proto::Scene& message, const std::string& prefix,
                               const EdgeLoader& load_edges) {
  demand_beams_alone(message, prefix);
  const proto::BeamScene& beams = message.beams();
  const std::string field = prefix + "beams";
  if (beams.has_job() && (beams.has_structure() || beams.has_lines()))
    throw invalid(field + ".job",
                  "stands for all: a job has neither a structure nor lines beside it");
  DecodedBeams decoded;
  if (beams.has_job()) {
    decoded = decode_beam_job(beams.job(), field + ".job");
  } else if (beams.has_lines()) {
    const std::string lines = field + ".lines";
    decoded = decode_beam_structure(beams.structure(), edges_of(beams.lines(), lines, load_edges),
                                    field + ".structure", lines);
  } else {
    decoded = decode_beam_structure(beams.structure(), field + ".structure");
  }
  if (beams.has_shape())
    decoded.shape = decode_beam_shape(beams.shape(), decoded.model, field + ".shape");
  with_fields_of(beams, field + ".",
                 [&] { decoded.discretisation = decode_discretisation(beams); });
  if (!message.name().empty()) decoded.name = message.name();
  return decoded;
}

proto::Scene encode_beam_scene(const DecodedBeams& structure) {
  proto::Scene message;
  message.set_name(structure.name);
  *message.mutable_beams()->mutable_structure() = encode_beam_structure(structure);
  if (structure.shape)
    *message.mutable_beams()->mutable_shape() = encode_beam_shape(*structure.shape);
  if (const auto& elements = structure.discretisation.elements_per_member)
    message.mutable_beams()->set_elements_per_member(static_cast<std::uint32_t>(*elements));
  if (const auto& tolerance = structure.discretisation.tolerance)
    message.mutable_beams()->set_tolerance(*tolerance);
  return message;
}

}  // namespace limber::server
